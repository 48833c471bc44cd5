"""Natural frequencies of a bladed disk for every nodal diameter against stored numbers of CalculiX, at rest and at 8000 rpm.

It prints seven digits: 5e-7 where the first one is a one.
"""

import numpy as np

from validation.calculix_stored import (
    lowest_frequencies,
    plain_tie,
    static_difference,
    stored_sector,
)
from validation.compare import Record, bound, record
from validation.reference_data import has_complete

SOURCE = "CalculiX 2.20, stored results"
DIGITS = 1e-6


def run() -> list[Record]:
    """Compare the medium mesh, or the rows of the coarse one that lie in the repository."""
    name = "medium" if has_complete() else "coarse"
    sector = stored_sector(name, complete=has_complete())
    case = f"24 blades, {name} mesh"
    solid, still = sector.solid, plain_tie(sector, 0)
    off = static_difference(sector, still)
    records = [
        bound(case, "static displacement at 8000 rpm: largest difference over its largest", off, DIGITS, SOURCE)
    ]  # fmt: skip
    states = {
        "free": ("at rest", solid.structure),
        "prestressed_8000rpm": ("at 8000 rpm", solid.at_speed(sector.speed, tie=still)),
    }
    for (kind, diameter), theirs in sector.frequencies.items():
        where, structure = states[kind]
        ours = lowest_frequencies(structure, plain_tie(sector, diameter), len(theirs))
        worst = int(np.argmax(np.abs(ours / theirs - 1)))
        quantity = (
            f"{where}, nodal diameter {diameter}, mode {worst + 1} (the worst of {len(theirs)}), Hz"
        )
        records.append(record(case, quantity, ours[worst], theirs[worst], DIGITS, SOURCE))
    return records
