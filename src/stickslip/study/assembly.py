"""Blades and damper put together, and the contacts between them."""

import numpy as np

from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.model.rigid.damper import ContactPoints, FlatCurvedDamper, gap_operator
from stickslip.model.structure import Structure, join
from stickslip.study.schema import StudyTables

MATCH = 1e-6  # m: a contact point and its node may differ by this much


def join_damper(
    tables: StudyTables, blades: Structure, damper: FlatCurvedDamper
) -> tuple[Structure, Interface]:
    """Return blades and damper side by side, and the contacts between them.

    Parameters
    ----------
    tables
        The study's contact tables.
    blades
        Full or reduced blades with the set ``contact``: x, y, z of each contact's node, in the order of the damper's points.
    damper
        The damper.

    Raises
    ------
    InputError
        If the nodes are not those of the contact points.
    """
    points, body = damper.contact_points(), damper.body()
    joined = join(blades=blades, damper=body.structure())
    dofs = joined.dof_set("blades.contact")
    _check_nodes(joined, points)
    operator = gap_operator(points, dofs.reshape(-1, 3), joined.dof_set("damper"), joined.n, body)
    return joined, Interface(points.names, contact_laws(tables, points), operator)


def contact_laws(tables: StudyTables, points: ContactPoints) -> tuple[ContactLaw, ...]:
    """Return the law of each contact: stiffnesses and slip limit of a side are shared equally among its points."""
    laws = {
        side: tables.contact.of_side(side).library(points.side.count(side))
        for side in set(points.side)
    }
    return tuple(laws[side] for side in points.side)


def _check_nodes(joined: Structure, points: ContactPoints) -> None:
    dofs = joined.dof_set("blades.contact")
    if dofs.size != 3 * len(points):
        raise input_error(
            "contact",
            f"non-matching node sets: {dofs.size // 3} nodes of the blades for {len(points)} contact points of the damper",
            "Give the blades one node for each contact point.",
        )
    off = np.linalg.norm(joined.dofs.position[dofs[::3]] - points.position, axis=1)
    worst = int(np.argmax(off))
    if off[worst] > MATCH:
        raise input_error(
            "contact",
            f"non-matching node sets: the node of contact {points.names[worst]} lies {off[worst]:.3g} m from it",
            "Give blades and damper the same angles, lines and sections.",
        )
