"""Free motions of bodies without supports, contacts or joins, and static loads that pull parts off contacts."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.assembly.locations import picked
from stickslip.assembly.model import Model
from stickslip.contact.law import ContactLaw, Rigid, holding_directions, softened
from stickslip.contact.laws import law_name
from stickslip.errors import InputError, input_error
from stickslip.model.part import Part
from stickslip.model.rigid.motion import in_words, loose_motions
from stickslip.response.equilibrium import opening

RANK = 1e-8  # singular value below which a motion causes no strain, relative to the value without cancellation
SHARE = 1e-6  # share of a free motion, relative to the largest, below which a body is not part of it
SLIDERS = ("jenkins", "iwan", "dahl")  # laws with a bounded force without normal force
NAMED = 3  # parts that a message names
WORK = 1e-6  # work below which it is rounding, relative to the largest work that the loads could do
STEEP = 1e3  # friction coefficient of laws without one


@dataclass(frozen=True, eq=False)
class Loose:
    """Body of a part without supports in the part.

    Parameters
    ----------
    part
        Name of the part.
    dofs
        (m,) dofs of the body, among those of all parts.
    motions
        (m, f) free motions of the body, the largest entry of each being 1.
    """

    part: str
    dofs: IntArray
    motions: FloatArray


def refuse_unheld(model: Model) -> None:
    """Refuse a model with a body that is free although all contacts stick.

    Raises
    ------
    InputError
        If there is such a body. The message names the part and its free motions.
    """
    found = unheld(model, np.ones(len(model.pairs.names), dtype=bool))
    if found:
        raise found[0]


def unheld(model: Model, holds: BoolArray) -> list[InputError]:
    """Return an error for each part that can move freely while only the contact points `holds` (p,) stick.

    The other contact points are open.
    """
    bodies = _loose(model)
    columns = _columns(bodies)
    free = _free(model, bodies, holds)
    found: dict[str, InputError] = {}
    for body, first, last in zip(bodies, columns, columns[1:], strict=False):
        own = free[first:last]
        left, sizes, _ = np.linalg.svd(own, full_matrices=False)
        shapes = body.motions @ left[:, sizes > SHARE]
        if shapes.shape[1]:
            complaint = _complaint(model, body, shapes, at_rest=not np.all(holds))
            found.setdefault(body.part, complaint)
    return list(found.values())


def held_warnings(model: Model, pressed: BoolArray) -> tuple[str, ...]:
    """Warn of parts that are free at rest, or free once all sliders slip.

    `pressed` (p,) are the contact points pressed at rest.
    """
    return (*open_warnings(model, pressed), *sliding_warnings(model, pressed))


def open_warnings(model: Model, pressed: BoolArray) -> tuple[str, ...]:
    """Warn of parts that are free at rest.

    `pressed` (p,) are the contact points pressed by the static loads; the others are open.
    """
    if np.all(pressed):
        return ()
    return tuple(
        f"{error} The mean of its vibration is known only where contacts close." for error in unheld(model, pressed)
    )


def sliding_warnings(model: Model, pressed: BoolArray) -> tuple[str, ...]:
    """Warn of parts that only sliders hold, and that are free once all of them slip.

    `pressed` (p,) are the contact points pressed at rest.
    """
    slides = np.array([law_name(law) in SLIDERS for law in model.pairs.laws], dtype=bool)
    if not slides.any():
        return ()
    at_rest = {error.place for error in unheld(model, pressed)}
    return tuple(
        f"{error.place}: sliders alone hold it; while all of them slip it is free, its mean position is undetermined, and the "
        "solution may fail there. Give it a spring to the ground, or a load that does not move them all."
        for error in unheld(model, pressed & ~slides)
        if error.place not in at_rest
    )


def free_motions(model: Model, holds: BoolArray) -> FloatArray:
    """Return the (N, f) strain-free motions of all dofs while the contact points `holds` (p,) stick."""
    bodies = _loose(model)
    return _moves(model, bodies) @ _free(model, bodies, holds)


def _columns(bodies: list[Loose]) -> IntArray:
    return np.cumsum([0, *(body.motions.shape[1] for body in bodies)])


def _moves(model: Model, bodies: list[Loose]) -> FloatArray:
    """Return the motions of bodies side by side, on the dofs of all parts."""
    columns = _columns(bodies)
    moves = np.zeros((model.places.n, columns[-1]))
    for body, first in zip(bodies, columns, strict=False):
        moves[body.dofs, first : first + body.motions.shape[1]] = body.motions
    return moves


def _free(model: Model, bodies: list[Loose], holds: BoolArray) -> FloatArray:
    """Return the shares (m, f) of the bodies' motions in the strain-free motions."""
    moves = _moves(model, bodies)
    rows = _holding(model, holds)
    strained = np.vstack([one @ moves for one in rows])
    largest = max((float((abs(one) @ abs(moves)).max(initial=0.0)) for one in rows), default=0.0)
    if len(strained) > moves.shape[1]:
        strained = np.asarray(np.linalg.qr(strained, mode="r"))
    _, values, right = np.linalg.svd(strained, full_matrices=True)
    rank = int(np.count_nonzero(values > RANK * largest))
    return np.asarray(right[rank:].T)


def _loose(model: Model) -> list[Loose]:
    bodies = []
    for name, part in model.parts.items():
        own = model.places.own(name)
        for dofs, motions in _of_part(part):
            if motions.shape[1]:
                bodies.append(Loose(name, own[dofs], motions))
    return bodies


def _of_part(part: Part) -> list[tuple[IntArray, FloatArray]]:
    """Return the free bodies of a part with their motions; they are cached."""
    if "loose" not in part.memo:
        structure = part.structure
        found: list[tuple[IntArray, FloatArray]] = [(np.arange(6), np.eye(6))]
        if part.body is None:
            found = loose_motions(structure.stiffness, structure.dofs)
        if part.sectors > 1 and _alike(part):
            found = [(dofs, _with_all_sectors(part, dofs, motions)) for dofs, motions in found]
        part.memo["loose"] = found
    loose: list[tuple[IntArray, FloatArray]] = part.memo["loose"]
    return loose


def _alike(part: Part) -> bool:
    """Whether cyclic faces let a sector move only together with all others."""
    return any(face in part.structure.sets for face in part.faces)


def _with_all_sectors(part: Part, dofs: IntArray, motions: FloatArray) -> FloatArray:
    """Return the free motions of a sector that all sectors can have together: along the axis and about it."""
    table, axis = part.structure.dofs.take(dofs), part.axis
    turning = np.cross(axis.unit, table.position - np.asarray(axis.origin))
    column = [("x", "y", "z").index(c) if c in ("x", "y", "z") else -1 for c in table.component]
    rows = np.arange(len(column))
    alike = np.column_stack([np.tile(axis.unit, (len(column), 1))[rows, column], turning[rows, column]])
    alike = np.where(np.array(column)[:, None] >= 0, np.nan_to_num(alike), 0.0)
    kept = [v / np.abs(v).max() for v in alike.T if np.any(v) and _inside(v, motions)]
    return np.column_stack(kept) if kept else motions[:, :0]


def _inside(vector: FloatArray, motions: FloatArray) -> bool:
    rest = vector - motions @ np.linalg.lstsq(motions, vector, rcond=None)[0]
    return bool(np.linalg.norm(rest) < 1e-6 * np.linalg.norm(vector))


def _holding(model: Model, holds: BoolArray) -> list[Matrix]:
    """Return rows on the dofs of all parts that are zero for strain-free motions."""
    pairs, ties = model.pairs, model.ties
    stiff = [np.ones(3, dtype=bool) if isinstance(law, Rigid) else holding_directions(law) for law in pairs.laws]
    rows = np.flatnonzero(np.repeat(holds, 3) & np.array(stiff, dtype=bool).reshape(-1))
    n = model.places.n
    found = [
        (pairs.own + pairs.following)[rows],
        picked(ties.followers, n) - ties.weights,
        picked(ties.high, n) - ties.onward @ picked(ties.low, n),
    ]
    if model.retention > 0:
        found.append(picked(model.places.bodies(), n))
    return found


def _complaint(model: Model, body: Loose, shapes: FloatArray, *, at_rest: bool) -> InputError:
    part = model.parts[body.part]
    words = in_words(model.places.dofs.take(body.dofs), shapes)
    if part.sectors > 1 and shapes.shape[1] == 2 and _alike(part):
        words = "moving along the axis and turning about it"
    whole = body.dofs.size == part.structure.n
    which = "" if whole else f"the body of {_label(part, body.dofs[0] - model.places.own(body.part)[0])} "
    what = "no closed contact, support" if at_rest else "no support, contact"
    add = "press its contacts by a static load" if at_rest else "add a contact with stiffness"
    spring = "give [retention] a stiffness" if part.body is not None else "give it a spring to the ground"
    return input_error(
        f"part.{body.part}",
        f"{which}is held by nothing{' at rest' if at_rest else ''}: {what} or join keeps it from {words}",
        f"Clamp it, join it, {add} in that direction, or {spring}.",
    )


def _label(part: Part, dof: int) -> str:
    """Return the name of a dof: of a set that contains only this dof, else of its node."""
    names = [name for name, members in part.structure.sets.items() if list(members) == [dof]]
    return (names or [part.structure.dofs.labels[dof]])[0]


def refuse_pulled(model: Model, static: Mapping[str, FloatArray]) -> None:
    """Refuse static loads under which bodies leave their contacts.

    There is no equilibrium if the loads do work on a rigid motion that strains no part and no join, and that opens each
    contact faster than its friction could resist (dual statement: no admissible contact forces balance the loads).

    Parameters
    ----------
    model
        The model.
    static
        (N,) forces on the dofs of all parts, by study key.

    Raises
    ------
    InputError
        If there is no equilibrium. The message names the load that does most work, and the parts that come off.
    """
    loaded = {key: force for key, force in static.items() if np.any(force)}
    if not loaded:
        return
    laws = softened(model.pairs.laws, 1.0)
    can = opening(laws)
    moves = free_motions(model, ~can)
    work = np.array([force @ moves for force in loaded.values()])
    least = WORK * np.sum([np.abs(force) @ np.abs(moves) for force in loaded.values()])
    if not np.any(np.abs(work.sum(axis=0)) > least):
        return
    gaps = ((model.pairs.own + model.pairs.following) @ moves).reshape(len(can), 3, -1)[can]
    friction = [_friction(law) for law, one in zip(laws, can, strict=True) if one]
    resisted = _resisted(gaps, np.array(friction).reshape(-1, 2, 1))
    motion = _fewest(model, (work.sum(axis=0), least), resisted, moves)
    if motion is None:
        return
    done = dict(zip(loaded, work @ motion, strict=True))
    worst = max(done, key=lambda key: done[key])
    moved = np.abs(moves @ motion)
    parts = [n for n in model.parts if moved[model.places.own(n)].max() > WORK * moved.max()]
    named = " and ".join(f"part.{name}" for name in parts)
    raise input_error(
        worst,
        f"pulls {named} off; contacts only press, and nothing else holds {'it' if len(parts) == 1 else 'them'} against the load",
        "Turn the load so that it presses the contacts, or hold the part by a support, a join or a spring to the ground.",
    )


def _resisted(gaps: FloatArray, friction: FloatArray) -> FloatArray:
    """Return rows that are not positive for motions that opening contacts, with gaps (p, 3, f), do not resist."""
    along, apart = friction * gaps[:, :2], gaps[:, 2]
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    return np.vstack([a * along[:, 0] + b * along[:, 1] - apart for a, b in signs])


def _friction(law: ContactLaw) -> FloatArray:
    """Return the friction coefficients along t and w."""
    return np.where(law.stuck_stiffness()[:2] > 0, getattr(law, "mu", STEEP), 0.0)


def _fewest(model: Model, work: tuple[FloatArray, float], resisted: FloatArray, moves: FloatArray) -> FloatArray | None:
    """Return a motion that loads drive and contacts do not resist, if possible of a single part.

    None if there is none.
    """
    for name in model.parts:
        others = np.delete(moves, model.places.own(name), axis=0)
        found = _driven(work, resisted, others)
        if found is not None:
            return found
    return _driven(work, resisted, moves[:0])


def _driven(work: tuple[FloatArray, float], resisted: FloatArray, still: FloatArray) -> FloatArray | None:
    """Return a motion with more than the least work, on which `resisted` is not positive and `still` zero.

    None if there is none.
    """
    own, least = work
    few = np.linalg.qr(still, mode="r") if len(still) else still
    none = np.zeros(len(few))
    found = scipy.optimize.linprog(-own, resisted, np.zeros(len(resisted)), few, none, bounds=(-1.0, 1.0))
    return np.asarray(found.x) if found.status == 0 and -found.fun > least else None
