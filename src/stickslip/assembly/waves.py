"""The sector that a model is, reduced wave by wave; waves that were reduced before are taken from memory or store."""

from dataclasses import replace

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.assembly.model import Model
from stickslip.assembly.reduced import (
    Store,
    at_speed,
    damped,
    forget,
    packed,
    steady_load,
    unpacked,
)
from stickslip.assembly.wheel import (
    ReducedSector,
    partners,
    reduced_wave,
    wave_numbers,
    wheel_of,
)
from stickslip.errors import InputError
from stickslip.model.structure import Structure, join
from stickslip.reduction.cache import content_hash
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.tuned import conjugate
from stickslip.reduction.whole_wheel import goes_both_ways

REMEMBERED = 64  # waves kept in memory


def reduced_sector(
    model: Model,
    order: tuple[int, int],
    kept: IntArray,
    stay: tuple[IntArray, IntArray],
    store: Store,
) -> ReducedSector:
    """Reduce the waves that an engine order excites.

    Parameters
    ----------
    model
        Of a sector.
    order
        Engine order and highest harmonic.
    kept, stay
        Dofs of all parts that stay physical, and those that have to be coordinates of their own: outputs, rigid bodies.
    store
        As in `Model.assembled`.
    """
    at, here = model.coordinates, model.neighbours
    assert here is not None
    structure, steady = _sector_at_speed(model)
    sector = here.sector(at.tied(structure), at)
    pairs = replace(
        model.pairs, own=at.columns(model.pairs.own), following=at.columns(model.pairs.following)
    )
    n_modes, whole = _modes(model)
    needed = np.unique(np.concatenate([kept, whole]))
    needed = needed[~np.isin(needed, model.ties.followers)]
    kept = np.unique(partners(sector)[at.of_dofs(needed, model.places.dofs, "part")])
    wheel = (sector.structure, sector.low, sector.high, sector.sectors, sector.axis)
    content = content_hash("wave", *wheel, kept, n_modes, steady)
    memo = next(iter(model.parts.values())).memo

    def made(k: int) -> tuple[Structure, Matrix]:
        key = f"{content} {k}"
        if key not in memo:
            memo[key] = _kept(sector, kept, k, n_modes, at.load(steady), (key, store))
            forget(memo, tuple, REMEMBERED)
        found: tuple[Structure, Matrix] = memo[key]
        return found

    mirrored = goes_both_ways(sector, sector.structure)

    def wave(k: int) -> tuple[Structure, Matrix]:
        if 2 * k <= sector.sectors or not mirrored:
            return made(k)
        structure, load = made(sector.sectors - k)
        return conjugate(structure), np.conj(load)

    waves = {k: wave(k) for k in wave_numbers(model.sectors, *order)}
    shown, bodies = (
        at.of_dofs(np.unique(dofs), model.places.dofs, "output.points") for dofs in stay
    )
    return wheel_of(sector, kept, waves, order, pairs, (shown, bodies))


def _sector_at_speed(model: Model) -> tuple[Structure, FloatArray]:
    """Return all parts side by side at the model's speed, damped, and the load of steady rotation on them."""
    spin, rest = model.spin(model.speed), model.steady
    own: dict[str, Structure] = {}
    steady = []
    for name, part in model.parts.items():
        turning = at_speed(name, part, spin, rest[name])
        steady.append(steady_load(part, spin, turning, rest[name]))
        own[name] = damped(name, part, turning)
    return join(**own), np.concatenate(steady)


def _modes(model: Model) -> tuple[int | None, IntArray]:
    """Return the number of modes kept of each wave, and the dofs of parts that are not reduced."""
    counts = [part.n_modes for part in model.parts.values() if part.body is None]
    if all(count is None for count in counts):
        return None, np.zeros(0, dtype=np.int64)
    high = np.zeros(0, dtype=np.int64) if model.neighbours is None else model.neighbours.high
    whole = [
        np.setdiff1d(model.places.own(name), high)
        for name, part in model.parts.items()
        if part.n_modes is None
    ]
    return sum(count or 0 for count in counts), np.concatenate([high[:0], *whole])


def _kept(
    sector: CyclicSector,
    kept: IntArray,
    k: int,
    n_modes: int | None,
    steady: FloatArray,
    where: tuple[str, Store],
) -> tuple[Structure, Matrix]:
    def make() -> tuple[Structure, Matrix]:
        try:
            return reduced_wave(sector, kept, k, n_modes, steady)
        except InputError as error:
            raise error.inside(f"wave {k}") from None

    if n_modes is None:
        return make()
    values = where[1](where[0], lambda: packed(*make()))
    return unpacked(values, sector.structure, kept)
