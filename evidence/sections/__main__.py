"""Solve, write ``docs/contact_points_numbers.md`` and draw its picture: ``python -m evidence.sections``."""

import argparse
import sys
from time import process_time

from evidence.sections import page
from evidence.sections.cases import solve


def say(line: str) -> None:
    """Print a line of progress with the CPU time so far."""
    print(f"{process_time():6.0f} s  {line}", flush=True)


def main() -> None:
    """Run."""
    argparse.ArgumentParser(
        prog="python -m evidence.sections",
        description="Convergence of the two blades with contact points and sections (Gastaldi & Berruti 2017, section 5.1): writes "
        "docs/contact_points_numbers.md and its picture. Takes some ten minutes; needs matplotlib, which `make pages NAME=sections` installs.",
    ).parse_args()
    try:
        from evidence.sections import (
            figure,  # matplotlib belongs to what builds the documentation
        )
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != "matplotlib":
            raise
        sys.exit("The picture needs matplotlib: `make pages NAME=sections` installs it and runs this.")
    found = solve(say)
    page.write(found)
    figure.draw(found)
    say(f"{page.NUMBERS.name}, {figure.FIGURE.name}")


if __name__ == "__main__":
    main()
