"""CalculiX as a judge: find it, run a deck, read what it printed."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray

PROGRAM = "ccx"
MISSING = f"{PROGRAM} is not installed: `make calculix` installs it where there is apt"


def available() -> str:
    """Return the path of CalculiX; empty where it is not installed."""
    return shutil.which(PROGRAM) or ""


def run_deck(deck: Path) -> str:
    """Run CalculiX on a deck, in its folder, on one core; return what it printed to the ``.dat`` file."""
    done = subprocess.run(
        [PROGRAM, deck.stem],
        cwd=deck.parent,
        env=dict(os.environ, OMP_NUM_THREADS="1"),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0 or "*ERROR" in done.stdout:
        raise RuntimeError(f"CalculiX could not run {deck}:\n{done.stdout[-2000:]}")
    return deck.with_suffix(".dat").read_text()


def frequencies_hz(printed: str) -> dict[int, FloatArray]:
    """Return nodal diameter -> frequencies in Hz, one of each pair that CalculiX prints for a cyclic model."""
    found: dict[int, list[float]] = {}
    for table in printed.split("E I G E N V A L U E   O U T P U T")[1:]:
        body = table.split("P A R T I C I P A T I O N")[0]
        for line in body.splitlines():
            words = line.split()
            if len(words) == 6 and re.fullmatch(r"\d+", words[0]):
                found.setdefault(int(words[0]), []).append(float(words[4]))
    return {diameter: np.array(values[::2]) for diameter, values in found.items()}


def displacements(printed: str) -> FloatArray:
    """Return the displacements (n, 3) of the static step, by node number."""
    _, _, body = printed.partition("displacements (vx,vy,vz)")
    rows = []
    for line in body.splitlines()[2:]:
        words = line.split()
        if len(words) != 4:
            break
        rows.append([float(word) for word in words])
    table = np.array(rows)
    return table[np.argsort(table[:, 0]), 1:]


def integration_stresses(printed: str) -> FloatArray:
    """Return the stresses (n, 6) of the static step at integration points, order xx, yy, zz, xy, yz, xz, in the file's order."""
    _, _, body = printed.partition("stresses (elem, integ.pnt.")
    rows = []
    for line in body.splitlines()[2:]:
        words = line.split()
        if len(words) < 8:
            break
        rows.append([float(word) for word in words[2:8]])
    return np.array(rows)[:, [0, 1, 2, 3, 5, 4]]
