"""``python -m evidence.strategies alarms | compare``: count missed and false alarms; compare all strategies and write ``docs/strategies.md``."""

import argparse
import sys

from evidence.strategies import alarms, compare, page
from evidence.strategies.random_systems import SYSTEMS


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        prog="python -m evidence.strategies",
        description="Compare all ways of choosing harmonics. How sharp their estimates are: python -m evidence.strategies.effectivity --help.",
    )
    commands = parser.add_subparsers(dest="command", required=True)
    counted = commands.add_parser(
        "alarms",
        help="count missed and false alarms of the strategies that verify, on the four cases, benchmark B6 and random systems; "
        "writes docs/strategies_alarms.md (ten to twenty minutes, about a second a random system)",
    )
    counted.add_argument("--systems", type=int, default=SYSTEMS, help="random systems of each set")
    commands.add_parser(
        "compare",
        help="cost and error of all strategies on four cases; writes docs/strategies.md, which takes in the alarms, "
        "and its figure (some ten minutes; needs matplotlib, which `make pages NAME=strategies` installs)",
    )
    given = parser.parse_args()
    if given.command == "alarms":
        alarms.run(given.systems)
    else:
        try:
            from evidence.strategies import (
                figure,  # matplotlib belongs to what builds the documentation
            )
        except ModuleNotFoundError as error:
            if error.name is None or error.name.split(".")[0] != "matplotlib":
                raise
            sys.exit("The comparison needs matplotlib: `make pages NAME=strategies` installs it and runs this.")
        found = compare.run()
        page.write(found)
        figure.draw(found)


if __name__ == "__main__":
    main()
