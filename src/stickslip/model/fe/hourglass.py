"""Whether bricks with one integration point are bent in their hourglass motions, which only an artificial stiffness resists."""

import numpy as np

from stickslip.arrays import BoolArray
from stickslip.model.fe.rotation import RotatingSolid
from stickslip.model.mesh.solid_mesh import faces_of
from stickslip.model.modes import normal_modes

MAX_HOURGLASS_SHARE = 0.05  # of the strain energy of a mode
MODES_EXAMINED = 6
OPPOSITE = ((0, 1), (2, 4), (3, 5))  # faces of a brick
REMEDY = "Mesh with C3D20R or C3D10, or with C3D8I, or finer."


def hourglass_doubts(solid: RotatingSolid, cut: BoolArray) -> tuple[str, ...]:
    """Return a sentence for hourglass energy above 5 % in the lowest modes, and one for single bricks through a thickness.

    Parameters
    ----------
    solid
        The solid.
    cut
        (nodes,) nodes on cut faces, which are no surfaces of the whole body.
    """
    if solid.hourglass is None:
        return ()
    return (*_of_modes(solid), *_of_thickness(solid, cut))


def _of_modes(solid: RotatingSolid) -> list[str]:
    structure, artificial = solid.structure, solid.hourglass
    modes = normal_modes(structure, min(MODES_EXAMINED, structure.n))
    strained = np.flatnonzero(modes.squares > 0)
    if not strained.size:
        return []
    shapes = modes.shapes[:, strained]
    share = np.sum(shapes * (artificial @ shapes), axis=0) / modes.squares[strained]
    worst = int(share.argmax())
    if share[worst] <= MAX_HOURGLASS_SHARE:
        return []
    over = np.count_nonzero(share > MAX_HOURGLASS_SHARE)
    said = (
        f"hourglass control of C3D8R bricks holds {100 * share[worst]:.3g} % of the strain energy of mode {strained[worst] + 1} "
        f"({modes.frequencies_hz[strained[worst]]:.5g} Hz, cut faces free); {over} of {strained.size} modes are above "
        f"{100 * MAX_HOURGLASS_SHARE:g} %. Frequencies depend on part.hourglass then. {REMEDY}"
    )
    return [said]


def _of_thickness(solid: RotatingSolid, cut: BoolArray) -> list[str]:
    bricks = [group.rows for group in solid.cell_groups if group.rule.hourglass is not None]
    faces, owner = faces_of(solid.mesh)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outside = np.zeros(len(faces), dtype=bool)
    outside[first[count == 1]] = True
    outside &= ~np.append(cut, True)[faces].all(axis=1)
    rows = np.concatenate(bricks)
    order = np.flatnonzero(np.isin(owner, rows))
    own = outside[order[np.argsort(owner[order], kind="stable")]].reshape(-1, 6)
    single = np.sort(rows)[np.any([own[:, a] & own[:, b] for a, b in OPPOSITE], axis=0)]
    if not single.size:
        return []
    number = solid.mesh.cell_numbers[single[0]]
    said = (
        f"{single.size} of {len(rows)} C3D8R bricks reach alone through a thickness, e.g. {number}: with one integration point they "
        f"bend at the price of hourglass control alone. {REMEDY}"
    )
    return [said]
