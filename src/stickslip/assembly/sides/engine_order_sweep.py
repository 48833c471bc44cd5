"""A model over a range of speeds: reduced at a few speeds, with polynomial interpolation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import scipy

from stickslip.arrays import FloatArray, as_array
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.build import assemble_tuned
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import Store, in_memory
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.errors import input_error
from stickslip.model.structure import Structure
from stickslip.reduction.speed_basis import ModesExchangedError
from stickslip.reduction.speed_line import AtRest, SpeedLine, speed_nodes

TOLERANCE = 1e-9  # relative, of squared frequencies and of the static load
INTERVALS = (2, 4, 8, 16)
DENSE = 1500  # coordinates up to which the error is taken over all motions, and above which over matrix entries


@dataclass(frozen=True, eq=False)
class OverSpeed:
    """A model along an engine-order line.

    Parameters
    ----------
    assembled
        Model assembled at the highest speed, with the system of the whole engine-order line.
    line
        Reduced matrices over the speed.
    error
        Relative error of the polynomials in squared frequencies and static load, at speeds midway between their nodes.
    static_force
        (k, p, 3) contact forces under the static loads alone at the speeds of the line, N.
    common
        Whether the reduction keeps the span of the modes of three speeds at all speeds, as it does if a mode outside
        the basis would replace a kept one at some speed.
    """

    assembled: Assembled
    line: SpeedLine
    error: float
    static_force: FloatArray
    common: bool = False


def with_engine_order(model: Model, order: int) -> Model:
    """Return a model with an engine order for every harmonic load, which keeps its harmonic.

    A single structure is returned unchanged.
    """
    if model.sectors == 1:
        return model
    loads = {
        name: replace(load, engine_order=order) if load.harmonic > 0 else load for name, load in model.loads.items()
    }
    return replace(model, loads=loads)


def over_speed(
    model: Model,
    engine_order: int,
    speeds: tuple[float, float],
    harmonics: int,
    store: Store = in_memory,
    tolerance: float = TOLERANCE,
) -> OverSpeed:
    """Assemble a model over a range of speeds.

    Parameters
    ----------
    model
        Model; its own speed is not used.
    engine_order
        Engine order of the first harmonic, from 1; on a wheel the engine order of the loads.
    speeds
        Lowest and highest speed, rad/s, above zero.
    harmonics
        Highest harmonic of the response.
    store
        As in `assemble`.
    tolerance
        Error at which no more speeds are added. At most 17 speeds are taken.

    Raises
    ------
    InputError
        If the engine order is invalid, or the model is mistuned or has different reduced coordinates at different speeds.
    """
    if not 0.0 < speeds[0] < speeds[1]:
        raise input_error("run_up", f"goes from {speeds[0]:g} to {speeds[1]:g} rad/s", "Give growing speeds above 0.")
    if model.aerodynamics is not None:
        raise input_error(
            "run_up",
            "does not follow aerodynamic forces over speed",
            "Leave [aero] out, or compute forced responses at single speeds.",
        )
    if model.mistuning is not None:
        raise input_error("run_up", "is of tuned wheels, and the model is mistuned", "Leave [mistuning] out.")
    if engine_order < 1:
        raise input_error(
            "run_up",
            f"follows engine orders from 1, got {engine_order}",
            "What all sectors feel alike has no speed that it goes with.",
        )
    lowest, highest = speeds
    middle = float(speed_nodes(lowest, highest, 2)[1])
    for like in ((highest,), (lowest, middle, highest)):
        own = replace(model, modes_like=like)
        try:
            found = _assembled(own, engine_order, speeds, harmonics, store, tolerance)
        except ModesExchangedError:
            continue
        return replace(found, common=len(like) > 1)
    raise AssertionError("modes of several speeds are not turned")


def _assembled(
    model: Model, engine_order: int, speeds: tuple[float, float], harmonics: int, store: Store, tolerance: float
) -> OverSpeed:
    refuse_whole("run_up", model)
    known: dict[float, Assembled] = {}

    def at(speed: float) -> Assembled:
        if speed not in known:
            turning = replace(model, speed=speed)
            known[speed] = assemble_tuned(turning, harmonics, store, checked=speed == speeds[1])
        return known[speed]

    for intervals in INTERVALS:
        nodes = speed_nodes(*speeds, intervals)
        every = [at(float(s)) for s in nodes]
        line = _line(engine_order, every, nodes)
        # midway between two speeds, which the next attempt also uses
        beside = float(speed_nodes(*speeds, 2 * intervals)[1 + 2 * (intervals // 2)])
        error = _difference(line, beside, at(beside))
        if error <= tolerance:
            break
    top = every[-1]
    system = replace(top.system, structure=line)
    assembled = replace(top, system=system, bare=system)
    return OverSpeed(assembled, line, error, np.array([a.static_force for a in every]))


def _line(order: int, every: Sequence[Assembled], nodes: FloatArray) -> SpeedLine:
    first = every[0]
    for other in every[1:]:
        gaps = [a.system.interface.gap_operator for a in (first, other)]
        alike = gaps[0].shape == gaps[1].shape and abs(gaps[0] - gaps[1]).max() == 0.0
        if not alike or not np.array_equal(first.system.retained, other.system.retained):
            raise input_error(
                "run_up",
                "the model has other coordinates at other speeds",
                "Reduce to a number of modes, not to a frequency or an error.",
            )
    sides = tuple(_at_rest(a) for a in every)
    harmonics = {h for a in every for h in a.load.harmonics}
    loads = {h: np.array([a.load.coefficients(h)[h] for a in every]) for h in {0, *harmonics}}
    return SpeedLine(order, nodes, sides, loads)


def _at_rest(assembled: Assembled) -> AtRest:
    return cast("AtRest", assembled.system.structure)


def _difference(line: SpeedLine, speed: float, true: Assembled) -> float:
    """Return the difference between a speed line and the model at a speed."""
    mine, theirs = line.at(speed), _at_rest(true)
    orders = range(1 + (line.harmonics or 0))
    pairs = {id(theirs.of_harmonic(h)): (mine.of_harmonic(h), theirs.of_harmonic(h)) for h in orders}
    found = [_of_structures(a, b, line.engine_order * speed) for a, b in pairs.values()]
    load = true.load.coefficients(max(line.loads))
    for h in line.loads:
        size = float(np.abs(line.loads[h]).max(initial=0.0))
        if size > 0.0:
            found.append(float(np.abs(line.load(h, speed) - load[h]).max()) / size)
    return max(found)


def _of_structures(mine: Structure, theirs: Structure, omega: float) -> float:
    """Return the largest difference of ``K + iωC - ω²M``, relative to the energy ``K + ω²M``, over all motions."""
    change = [
        as_array(a) - as_array(b)
        for a, b in ((mine.stiffness, theirs.stiffness), (mine.damping, theirs.damping), (mine.mass, theirs.mass))
    ]
    size = as_array(theirs.stiffness) + omega**2 * as_array(theirs.mass)
    factors = 1.0, omega, omega**2
    diagonal = np.abs(np.diagonal(size))
    scale = np.sqrt(np.maximum(diagonal, 1e-9 * diagonal.max()))
    matrices = [f * c / np.outer(scale, scale) for f, c in zip(factors, change, strict=True)]
    if len(scale) > DENSE:
        return float(max(np.abs(m).max() for m in matrices))
    values, vectors = np.linalg.eigh(size / np.outer(scale, scale))
    good = values > 1e-12 * values.max()
    inverse = vectors[:, good] / np.sqrt(values[good])
    return float(max(scipy.linalg.norm(inverse.conj().T @ m @ inverse, 2) for m in matrices))
