"""Draw the figures into docs/images and write docs/seed_figures.md: ``python -m evidence.figures``."""

import argparse
import sys
from pathlib import Path
from time import process_time

from evidence.figures.evidence import gather
from evidence.figures.model import FIRST, FIRST_PLAN, SECOND, SECOND_PLAN, model
from evidence.figures.page import page
from evidence.figures.statements import statements
from evidence.figures.statements.statement import numbered, tally

DOCS = Path(__file__).parents[2] / "docs"
PAGE, IMAGES = "seed_figures.md", "images"


def say(line: str) -> None:
    """Print a line of progress with the CPU time so far."""
    print(f"{process_time():6.0f} s  {line}", flush=True)


def main() -> int:
    """Compute, draw and write."""
    parser = argparse.ArgumentParser(
        prog="python -m evidence.figures",
        description="Draw the counterparts of the figures of Gastaldi & Berruti (2017) for the two cases of evidence/figures/model.py into docs/images, "
        "and write docs/seed_figures.md. Takes some minutes; needs matplotlib, which `make pages NAME=figures` installs.",
    )
    parser.add_argument("--into", type=Path, default=DOCS, help="another folder than docs, for a trial")
    docs: Path = parser.parse_args().into
    try:
        from evidence.figures.draw import (
            draw_all,  # matplotlib belongs to what builds the documentation
        )
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != "matplotlib":
            raise
        print("The figures need matplotlib: `make pages NAME=figures` (or `make docs`) installs it and runs this.")
        return 1
    say("meshing and reducing both models")
    evidence = gather(model(FIRST), model(SECOND), FIRST_PLAN, SECOND_PLAN, say)
    rows = statements(evidence)
    say("pictures")
    (docs / IMAGES).mkdir(parents=True, exist_ok=True)
    for file in draw_all(evidence, docs / IMAGES):
        say(f"{file.name}, {file.stat().st_size / 1000:.0f} kB")
    text = page(evidence, rows, (FIRST.said(), SECOND.said()), process_time())
    (docs / PAGE).write_text(text, encoding="utf-8")
    for name, row in numbered(rows):
        say(f"{name} {row.claim}: {row.said}")
    say(tally(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
