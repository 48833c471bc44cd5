"""Positions of the gaps of rigid contacts among the coordinates of a periodic problem."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import Rigid
from stickslip.errors import InputError, input_error
from stickslip.harmonic.balance import HarmonicBalance

NORMAL = 2
STIFF = 1e5  # stiffness of springs that replace rigid contacts, relative to the structure at the contacts: error 1e-5


@dataclass(frozen=True, eq=False)
class RigidContacts:
    """The rigid contacts of an interface, and their gaps as retained coordinates.

    Attributes
    ----------
    index
        (n_rigid,) positions of the rigid contacts in the interface.
    mu, constant
        (n_rigid,) friction coefficients; constant normal loads, scaled, NaN where the normal force is a reaction.
    contact, direction, column, factor, offset
        (n_gaps,) for each gap: its rigid contact, its direction (0, 1, 2 for t, w, n), its retained coordinate, the
        ratio of gap to coordinate, and the scaled gap at zero displacement.
    """

    index: IntArray
    mu: FloatArray
    constant: FloatArray
    contact: IntArray
    direction: IntArray
    column: IntArray
    factor: FloatArray
    offset: FloatArray


def rigid_contacts(interface: Interface, rigid: IntArray, balance: HarmonicBalance) -> RigidContacts:
    """Find the coordinates of the gaps, and scale all parameters as in a periodic problem.

    Parameters
    ----------
    interface
        All contacts, on the retained coordinates.
    rigid
        (n_rigid,) positions of the rigid contacts.
    balance
        The periodic problem without rigid contacts.

    Raises
    ------
    InputError
        If a gap is not a coordinate, or two gaps are the same coordinate.
    """
    length, force = balance.displacement_scale, balance.force_scale
    entries: list[tuple[int, int, int, float]] = []
    for c, i in enumerate(rigid):
        entries += [(c, *entry) for entry in _gap_coordinates(interface, i)]
    contact, direction, column = (np.array([e[k] for e in entries], dtype=np.int64) for k in range(3))
    factor = np.array([e[3] for e in entries])
    if np.unique(column).size < column.size:
        twice = column[np.argmax(np.bincount(column)[column] > 1)]
        names = [interface.names[rigid[c]] for c in contact[column == twice]]
        raise _no_coordinate(" and ".join(names), "share one coordinate")
    laws = [law for law in interface.laws if isinstance(law, Rigid)]
    gaps = np.array([law.initial_gap for law in laws]) / length
    constant = np.array([np.nan if law.preload is None else law.preload for law in laws])
    return RigidContacts(
        rigid,
        np.array([law.mu for law in laws]),
        constant * interface.factors[rigid] / force,
        contact,
        direction,
        column,
        factor,
        np.where(direction == NORMAL, gaps[contact], 0.0),
    )


def _gap_coordinates(interface: Interface, contact: int) -> list[tuple[int, int, float]]:
    """Return (direction, coordinate, factor) of the gaps of a contact."""
    law, name = interface.laws[contact], interface.names[contact]
    found = []
    for d in range(3):
        row = interface.gap_operator[[3 * contact + d]]
        columns = row.indices
        constant = isinstance(law, Rigid) and law.preload is not None
        if columns.size == 0 or (d == NORMAL and constant):
            continue
        if columns.size > 1:
            raise _no_coordinate(name, "has a gap between several coordinates")
        found.append((d, int(columns[0]), float(row.data[0])))
    if isinstance(law, Rigid) and law.preload is None and NORMAL not in [d for d, _, _ in found]:
        raise input_error(
            f"contact {name}",
            "is unilateral and has no normal gap",
            "Give it a normal direction, or a constant normal load (preload).",
        )
    return found


def _no_coordinate(name: str, problem: str) -> InputError:
    return input_error(
        f"rigid contact {name}",
        problem,
        "Write the structure in_relative_coordinates, where every gap is a coordinate.",
    )
