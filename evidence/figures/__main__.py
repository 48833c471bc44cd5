"""Draw the figures into docs/images and write docs/seed_figures.md: ``python -m evidence.figures``."""

import argparse
import sys
from pathlib import Path
from time import process_time

from evidence.figures.evidence import Plan, gather
from evidence.figures.model import GLUED, model
from evidence.figures.page import page
from evidence.figures.solve import PATIENCE, STEPS
from evidence.figures.statements import statements

DOCS = Path(__file__).parents[2] / "docs"


def say(line: str) -> None:
    """Print a line of progress with the CPU time so far."""
    print(f"{process_time():6.0f} s  {line}", flush=True)


def main() -> int:
    """Compute, draw and write."""
    argparse.ArgumentParser(
        prog="python -m evidence.figures",
        description="Draw the counterparts of the figures of Gastaldi & Berruti (2017) for the two blades into docs/images, "
        "and write docs/seed_figures.md. Takes some five minutes; needs matplotlib, which `make figures` installs.",
    ).parse_args()
    try:
        from evidence.figures.draw import (
            draw_all,  # matplotlib belongs to what builds the documentation
        )
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != "matplotlib":
            raise
        print(
            "The figures need matplotlib: `make figures` (or `make docs`) installs it and runs this."
        )
        return 1
    say("meshing and reducing both models")
    evidence = gather(model(), model(**GLUED), Plan(), say)
    rows = statements(evidence)
    say("pictures")
    for file in draw_all(evidence, DOCS / "images"):
        say(f"{file.name}, {file.stat().st_size / 1000:.0f} kB")
    glued = ", ".join(f"`{key} = {value}`" for key, value in GLUED.items())
    text = page(evidence, rows, glued, (STEPS, PATIENCE, process_time()))
    (DOCS / "seed_figures.md").write_text(text, encoding="utf-8")
    for row in rows:
        say(f"{row.place}: {row.claim}: {row.verdict}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
