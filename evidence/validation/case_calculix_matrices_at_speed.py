"""Stored matrices of CalculiX at four speeds: frequencies and static state at another speed, against its own."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.sparse.linalg

from evidence.models.annulus import annular_sector
from evidence.validation.calculix import MISSING, available, displacements, run_deck
from evidence.validation.compare import Record, bound, left_out, record
from stickslip.model.axis import Axis
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.matrices_at_speeds import AtSpeed, SpeedMatrices, speed_matrices
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix import read_calculix_matrices
from stickslip.units import RPM

SOURCE = "CalculiX, run on a deck that we wrote"
CASE = "a piece of a ring as a blade, matrices stored at 0, 4000, 8000 and 12,000 rpm"
SPEEDS = (0.0, 4000.0, 8000.0, 12000.0)
BETWEEN = 7000.0  # rpm
MODES = 5
DIGITS = 1e-6
STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)


def stored(folder: Path) -> tuple[SpeedMatrices, str]:
    """Let CalculiX store the matrices, and return them with what it printed at the speed between."""
    mesh = annular_sector(0.2, 0.3, 0.02, sectors=36, divisions=(4, 2, 1))
    known = []
    for rpm in (*SPEEDS, BETWEEN):
        deck, last = folder / f"n{rpm:.0f}.inp", rpm == BETWEEN
        write_deck(mesh, STEEL, deck, run=CalculixRun(n_modes=MODES, matrices=not last, speed=RPM * rpm))
        printed = run_deck(deck)
        if not last:
            structure = read_calculix_matrices(deck.with_suffix(".sti"))
            moved = displacements(printed)[structure.dofs.node - 1] if rpm else None
            component = ["xyz".index(c) for c in structure.dofs.component]
            shift = None if moved is None else moved[np.arange(structure.n), component]
            known.append(AtSpeed(RPM * rpm, structure, shift))
    sets = known[0].structure.sets
    known = [replace(one, structure=replace(one.structure, sets=sets)) for one in known]
    return speed_matrices(known, Axis()), printed


def frequencies(printed: str) -> list[float]:
    """Return the frequencies in Hz that CalculiX printed for a structure that is not cyclic."""
    body = printed.partition("E I G E N V A L U E   O U T P U T")[2].partition("P A R T I C I P A T I O N")[0]
    return [float(words[3]) for words in map(str.split, body.splitlines()) if len(words) == 5 and words[0].isdigit()]


def run() -> list[Record]:
    """Compare frequencies and the largest displacement; without CalculiX the comparison is left out."""
    if not available():
        return [left_out(CASE, MISSING, SOURCE)]
    with tempfile.TemporaryDirectory() as name:
        own, printed = stored(Path(name))
    there = own.at_speed(RPM * BETWEEN)
    records = [
        record(CASE, f"mode {i} at {BETWEEN:.0f} rpm, Hz", ours, theirs, DIGITS, SOURCE)
        for i, (ours, theirs) in enumerate(
            zip(natural_frequencies(there, MODES), frequencies(printed), strict=True), start=1
        )
    ]
    moved = scipy.sparse.linalg.spsolve(there.stiffness.tocsc(), own.static_load(RPM * BETWEEN))
    reference = displacements(printed)
    theirs = reference[there.dofs.node - 1, ["xyz".index(c) for c in there.dofs.component]]
    off = float(np.abs(moved - theirs).max() / np.abs(theirs).max())
    records.append(bound(CASE, "static displacement: largest difference over its largest", off, DIGITS, SOURCE))
    records.append(bound(CASE, "error told at a speed left out, of the change by the speed", own.error, 1e-4, SOURCE))
    return records
