"""``python -m strategies alarms | compare``: count missed and false alarms; compare all strategies and write ``docs/strategies.md``."""

import argparse

from strategies import alarms, compare, page
from strategies.random_systems import SYSTEMS


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m strategies", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    counted = commands.add_parser("alarms", help="missed and false alarms")
    counted.add_argument("--systems", type=int, default=SYSTEMS, help="random systems of each set")
    commands.add_parser("compare", help="cost and error of all strategies on four cases")
    given = parser.parse_args()
    if given.command == "alarms":
        alarms.run(given.systems)
    else:
        from strategies import figure  # matplotlib belongs to what builds the documentation

        found = compare.run()
        page.write(found)
        figure.draw(found)


if __name__ == "__main__":
    main()
