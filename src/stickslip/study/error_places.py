"""Where the error of missing harmonics is taken: labels of a study file as dofs of its model."""

import numpy as np

from stickslip.arrays import IntArray
from stickslip.errors import did_you_mean, input_error
from stickslip.model.rigid.damper import ContactPoints
from stickslip.model.structure import Structure
from stickslip.study.schema import StudyTables

AXES = ("x", "y", "z")
OUTPUT_NODES = ("tip1", "edge1", "tip2")
OUTPUT_LABELS = tuple(f"{node}.{axis}" for node in OUTPUT_NODES for axis in AXES)
ROTATIONS = ("rx", "ry", "rz")
DAMPER_LABELS = tuple(f"damper.{c}" for c in (*AXES, *ROTATIONS))


def contact_labels(points: ContactPoints) -> tuple[str, ...]:
    """Return the labels of the blades' motion at the contact points."""
    return tuple(f"{name}.{axis}" for name in points.names for axis in AXES)


def error_labels(tables: StudyTables, points: ContactPoints) -> tuple[str, ...]:
    """Return the labels over which the error is taken, by default the outputs along the excitation.

    Raises
    ------
    InputError
        If the study names one that is none.
    """
    over = tables.harmonics.alert_over
    if over == "outputs":
        return OUTPUT_LABELS
    if over == "contacts":
        return contact_labels(points)
    if over == "along":
        # where the motion is
        axis = tables.loads.excitation_direction
        return tuple(label for label in OUTPUT_LABELS if label.endswith(axis))
    known = [*OUTPUT_LABELS, *contact_labels(points), *DAMPER_LABELS]
    for label in over:
        if label not in known:
            raise input_error(
                "harmonics.alert_over",
                f"{label!r} is neither an output nor a contact point's or the damper's motion",
                did_you_mean(label, known),
            )
    return tuple(dict.fromkeys(over))


def mixed_places(labels: tuple[str, ...]) -> list[str]:
    """Return a warning where an error is taken over rotations and displacements together."""
    rotations = [label for label in labels if label.rpartition(".")[2] in ROTATIONS]
    others = [label for label in labels if label not in rotations]
    if not rotations or not others:
        return []
    text = (
        f"harmonics.alert_over mixes rotations ({', '.join(rotations)}) with displacements ({', '.join(others)}): dofs that move less "
        "than a thousandth of the largest are left out, and here radians are held against metres. Name one kind only."
    )
    return [text]


def dofs_of(joined: Structure, points: ContactPoints, labels: tuple[str, ...]) -> IntArray:
    """Return the dofs of blades and damper that have these labels."""
    names = (*OUTPUT_LABELS, *contact_labels(points), *DAMPER_LABELS)
    sets = ("blades.output", "blades.contact", "damper")
    dofs = np.concatenate([joined.dof_set(name) for name in sets])
    place = dict(zip(names, dofs, strict=True))
    return np.array([place[label] for label in labels])
