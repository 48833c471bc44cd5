"""Refusal of static loads that pull apart parts held by contacts alone."""

from collections.abc import Mapping

import numpy as np
import scipy

from stickslip.arrays import FloatArray
from stickslip.assembly.joints.unconstrained_bodies import free_motions
from stickslip.assembly.model import Model
from stickslip.contact.law import ContactLaw, softened
from stickslip.errors import input_error
from stickslip.response.static_contact_state import opening

WORK = 1e-6  # of what the loads could do at most, below which work is rounding
STEEP = 1e3  # friction coefficient taken for a law that names none


def refuse_pulled(model: Model, static: Mapping[str, FloatArray]) -> None:
    """Refuse static loads under which bodies leave their contacts.

    There is no equilibrium if the loads do work on a rigid motion that strains no part and no join, and that opens each contact
    more steeply than its friction could resist (the dual of: no admissible contact forces balance the loads).

    Parameters
    ----------
    model
        The model.
    static
        (N,) forces on the dofs of all parts, by the key that gives them.

    Raises
    ------
    InputError
        Naming the load that does most work, and the parts that come off.
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
        f"pulls {named} off: the contacts only press, and nothing else holds {'it' if len(parts) == 1 else 'them'} against the load",
        "Turn the load so that it presses the contacts, or hold the part by a support, a join or a spring to the ground.",
    )


def _resisted(gaps: FloatArray, friction: FloatArray) -> FloatArray:
    """Return rows that are not positive for motions which contacts that can open, with gaps (p, 3, f), do not resist."""
    along, apart = friction * gaps[:, :2], gaps[:, 2]
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    return np.vstack([a * along[:, 0] + b * along[:, 1] - apart for a, b in signs])


def _friction(law: ContactLaw) -> FloatArray:
    """Return the friction coefficients along t and w."""
    return np.where(law.stuck_stiffness()[:2] > 0, getattr(law, "mu", STEEP), 0.0)


def _fewest(model: Model, work: tuple[FloatArray, float], resisted: FloatArray, moves: FloatArray) -> FloatArray | None:
    """Return a motion that loads drive and contacts do not resist, of one part where there is such a one; None of none."""
    for name in model.parts:
        others = np.delete(moves, model.places.own(name), axis=0)
        found = _driven(work, resisted, others)
        if found is not None:
            return found
    return _driven(work, resisted, moves[:0])


def _driven(work: tuple[FloatArray, float], resisted: FloatArray, still: FloatArray) -> FloatArray | None:
    """Return a motion that does more than the least work, for which rows are not positive and others vanish."""
    own, least = work
    few = np.linalg.qr(still, mode="r") if len(still) else still
    none = np.zeros(len(few))
    found = scipy.optimize.linprog(-own, resisted, np.zeros(len(resisted)), few, none, bounds=(-1.0, 1.0))
    return np.asarray(found.x) if found.status == 0 and -found.fun > least else None
