"""``python -m strategies alarms``: count missed and false alarms and write ``docs/strategies_alarms.md``."""

import argparse

from strategies import alarms
from strategies.random_systems import SYSTEMS


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m strategies", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    counted = commands.add_parser("alarms", help="missed and false alarms")
    counted.add_argument("--systems", type=int, default=SYSTEMS, help="random systems of each set")
    given = parser.parse_args()
    alarms.run(given.systems)


if __name__ == "__main__":
    main()
