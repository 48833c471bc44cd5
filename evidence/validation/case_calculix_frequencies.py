"""Natural frequencies of a bladed disk for every nodal diameter against stored numbers of CalculiX, at rest and at 8000 rpm.

It prints seven digits: 5e-7 where the first one is a one. Of the Coriolis terms, for one sector without ties, the change of each
frequency is compared, which it computes on its first twenty modes; so do we here (`gyroscopic_modes` is better than that).
"""

import csv

import numpy as np
import scipy.linalg

from evidence.validation.calculix_stored import (
    StoredSector,
    lowest_frequencies,
    plain_tie,
    static_difference,
    stored_sector,
)
from evidence.validation.compare import Record, bound, record
from evidence.validation.reference_data import folder, has_complete
from stickslip.arrays import FloatArray
from stickslip.model.modes import normal_modes

SOURCE = "CalculiX 2.20, stored results"
DIGITS = 1e-6
BASIS = 20  # modes
LARGE = 0.05  # Hz: smaller changes drown in the printed digits
CHANGE = 0.02  # of a change: it is the difference of two numbers with 5e-4 Hz of rounding each


def run() -> list[Record]:
    """Compare the medium mesh, or the rows of the coarse one that lie in the repository."""
    name = "medium" if has_complete() else "coarse"
    sector = stored_sector(name, complete=has_complete())
    case = f"24 blades, {name} mesh"
    solid, still = sector.solid, plain_tie(sector, 0)
    off = static_difference(sector, still)
    records = [bound(case, "static displacement at 8000 rpm: largest difference over its largest", off, DIGITS, SOURCE)]
    states = {
        "free": ("at rest", solid.structure),
        "prestressed_8000rpm": ("at 8000 rpm", solid.at_speed(sector.speed, tie=still)),
    }
    for (kind, diameter), theirs in sector.frequencies.items():
        where, structure = states[kind]
        ours = lowest_frequencies(structure, plain_tie(sector, diameter), len(theirs))
        worst = int(np.argmax(np.abs(ours / theirs - 1)))
        quantity = f"{where}, nodal diameter {diameter}, mode {worst + 1} (the worst of {len(theirs)}), Hz"
        records.append(record(case, quantity, ours[worst], theirs[worst], DIGITS, SOURCE))
    if has_complete():
        records += coriolis(name, sector)
    return records


def coriolis(name: str, sector: StoredSector) -> list[Record]:
    """Compare how Coriolis terms change the frequencies of one untied sector."""
    with (folder("calculix", complete=True) / "n24_coriolis_one_sector_frequencies.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["mesh"] == name]
    without, with_terms = (
        np.array([float(row["frequency_hz"]) for row in rows if row["coriolis"] == word]) for word in ("no", "yes")
    )
    theirs = with_terms - without[: len(with_terms)]
    turning = sector.solid.at_speed(sector.speed, coriolis=True)
    modes = normal_modes(turning, BASIS)
    ours = damped_frequencies(modes.squares, modes.shapes.T @ (turning.damping @ modes.shapes))
    ours -= modes.frequencies_hz
    case = f"one of 24 sectors, {name} mesh"
    return [
        record(case, f"at 8000 rpm, change of mode {i + 1} by Coriolis terms, Hz", ours[i], theirs[i], CHANGE, SOURCE)
        for i in range(10)
        if abs(theirs[i]) > LARGE
    ]


def damped_frequencies(squares: FloatArray, damping: FloatArray) -> FloatArray:
    """Return the frequencies in Hz of ``q'' + damping q' + diag(squares) q = 0``, lowest first."""
    n = len(squares)
    first_order = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(squares), -damping]])
    rates = scipy.linalg.eigvals(first_order)
    return np.sort(rates.imag[rates.imag > 0]) / (2 * np.pi)
