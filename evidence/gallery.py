"""Draw the gallery of figures for papers from small runs of the examples: ``make pages NAME=gallery``.

Writes the pictures of ``docs/paper_figures.md`` into ``docs/images/paper``. The runs are those of `evidence.baseline`, a few minutes each.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from evidence.baseline.studies import examples
from evidence.baseline.trees import ROOT
from stickslip import Result
from stickslip.report.paper.figure import write_figure

PICTURES = ROOT / "docs" / "images" / "paper"
# example -> its figures on the page
SHOWN = {
    "four_masses": ("response", "optimisation", "loops_t", "states"),
    "backbone": ("backbones", "nonlinear_mode_damping"),
    "flutter": ("flutter",),
    "flutter_ring": ("limit_cycles",),
    "mistuned_wheel": ("wheel", "blades"),
    "load_levels": ("modal_synthesis",),
    "two_tones": ("two_frequencies",),
}


def result_of(example: str, runs: Path) -> Path:
    """Return the folder of an example's results below `runs`; it is run there if it was not."""
    folder = runs / example
    if not (folder / "results").is_dir():
        next(own for own in examples() if own.name == example).write(folder)
        subprocess.run([sys.executable, "-m", "stickslip", "run", "study.toml", "--no-report"], cwd=folder, check=False)
    return folder / "results"


def main() -> None:
    """Run what was not run, and draw."""
    parser = argparse.ArgumentParser(prog="python -m evidence.gallery", description=__doc__)
    parser.add_argument("--runs", type=Path, help="A folder of earlier runs; left out: a new one that is removed.")
    given = parser.parse_args().runs
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as fresh:
        for example, names in SHOWN.items():
            result = Result.from_file(result_of(example, given or Path(fresh)))
            for name in names:
                write_figure(result.plot(name), name, PICTURES / f"{example}-{name}.png", "85mm")
                print(f"{example}: {name}", flush=True)


if __name__ == "__main__":
    main()
