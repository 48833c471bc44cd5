"""A sector reduced wave by wave; known waves are taken from memory or the store."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix, as_array
from stickslip.assembly.fluid.aero_forces import Flow
from stickslip.assembly.forces import force_of
from stickslip.assembly.joints.ties import Coordinates
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import (
    Spin,
    Store,
    at_speed,
    damped,
    forget,
    packed,
    steady_load,
    unpacked,
    with_ways_back,
)
from stickslip.assembly.sides.wheel import (
    DampingOfParts,
    ReducedSector,
    leaders,
    modes_of_wave,
    reduced_wave,
    wave_numbers,
    wheel_of,
)
from stickslip.errors import InputError, input_error
from stickslip.model.damping import Damping
from stickslip.model.part import Part
from stickslip.model.slow_steps import step
from stickslip.model.structure import Structure, join
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.cache import content_hash
from stickslip.reduction.choice import Reduction
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.tuned import conjugate
from stickslip.reduction.whole_wheel import goes_both_ways

REMEMBERED = 64  # cached waves
MODES_REMEMBERED = 24  # cached sets of modes of waves at other speeds


def reduced_sector(
    model: Model,
    order: tuple[int, int],
    kept: IntArray,
    stay: tuple[IntArray, IntArray],
    store: Store,
    more: Sequence[int] = (),
    flow: Flow | None = None,
) -> ReducedSector:
    """Reduce the waves that an engine order excites, and add the aerodynamic force.

    Parameters
    ----------
    model
        Model of a sector.
    order
        Engine order and highest harmonic.
    kept, stay
        Dofs of all parts that stay physical, and those that must be coordinates: outputs, rigid bodies.
    store
        As in `assemble`.
    more
        Further wave numbers.
    flow
        Aerodynamic force on the model; None without a fluid.
    """
    numbers = sorted({*wave_numbers(model.sectors, *order), *more})
    found = sector_waves(model, numbers, kept, store, flow=flow)
    at = model.coordinates
    pairs = replace(model.pairs, own=at.columns(model.pairs.own), following=at.columns(model.pairs.following))
    shown, bodies = (at.of_dofs(np.unique(dofs), model.places.dofs, "output.points") for dofs in stay)
    wheel = wheel_of(found.sector, found.kept, found.waves, order, pairs, (shown, bodies))
    return found.with_forces(wheel)


@dataclass(frozen=True, eq=False)
class SectorWaves:
    """Reduced waves of a wheel.

    Parameters
    ----------
    sector
        The unreduced sector.
    kept
        (k,) dofs of the sector that are the first coordinates of the waves.
    waves
        Wave number -> structure without `basis`, and the loads that `reduced_wave` projected on it.
    forces
        Wave number -> aerodynamic force, which the structure does not include; empty without a fluid.
    fields
        Wave number -> (n, l) loads of `Model.spread`.
    bases
        Wave number -> (n_sector, n) map to the sector's dofs; None unless the store is `with_ways_back`.
    """

    sector: CyclicSector
    kept: IntArray
    waves: Mapping[int, tuple[Structure, Matrix]]
    forces: Mapping[int, Feedback] = field(default_factory=dict)
    fields: Mapping[int, Matrix] = field(default_factory=dict)
    bases: Mapping[int, Matrix] = field(default_factory=dict)

    def with_forces(self, found: ReducedSector) -> ReducedSector:
        """Return the waves in other coordinates, with their aerodynamic forces and pressure fields."""
        spread = {k: found.ways[k].conj().T @ own for k, own in self.fields.items()}
        found = replace(found, fields=spread, bases=self.bases)
        if not self.forces:
            return found
        forces = {k: own.in_coordinates(found.ways[k]) for k, own in self.forces.items()}
        return replace(found, wheel=found.wheel.with_aerodynamics(forces))


def sector_waves(
    model: Model,
    numbers: Sequence[int],
    kept: IntArray,
    store: Store,
    rows: Matrix | None = None,
    flow: Flow | None = None,
) -> SectorWaves:
    """Reduce waves of a sector, all to the same number of coordinates.

    Parameters
    ----------
    model
        Model of a sector.
    numbers
        Wave numbers.
    kept
        Dofs of all parts that stay physical.
    store
        As in `assemble`.
    rows
        (r, N) CSR operator on the dofs of all parts. Each row adds a load, as a column after the load of steady
        rotation.
    flow
        Aerodynamic force on the model; None without a fluid.
    """
    at, here = model.coordinates, model.neighbours
    assert here is not None
    spin = model.spin(model.speed)
    with step(f"stiffening by rotation of a sector with {model.places.n} dofs"):
        structure, steady = _sector_at_speed(model, spin)
    sector = here.sector(at.tied(structure), at)
    reduction, damping, whole = _reduction(model)
    needed = np.unique(np.concatenate([kept, whole]))
    needed = needed[~np.isin(needed, model.ties.followers)]
    kept = leaders(sector, at.of_dofs(needed, model.places.dofs, "part"))
    loads = at.load(steady)
    if rows is not None:
        columns = scipy.sparse.csr_array(at.columns(rows).T)
        loads = scipy.sparse.hstack([scipy.sparse.csr_array(loads[:, None]), columns], format="csr")
    wheel = (sector.structure, sector.low, sector.high, sector.sectors, sector.axis, sector.weights, sector.ahead)
    like = () if reduction is None else spin.references
    own = _content_of(model, like, wheel[1:], kept)
    content = content_hash("wave", *wheel, kept, damping, loads, own)
    memo, spread = next(iter(model.parts.values())).memo, _spread(model)
    mirrored = goes_both_ways(sector, sector.structure)

    def modes_at(other: Spin, k: int, reduction: Reduction) -> Matrix:
        key = f"modes {own} {other.speed!r} {reduction} {k}"
        if key not in memo:
            there = here.sector(at.tied(_sector_at_speed(model, other)[0]), at)
            memo[key] = modes_of_wave(there, kept, k, reduction)
            forget(memo, np.ndarray, MODES_REMEMBERED)
        return memo[key]

    def others(k: int, reduction: Reduction | None) -> list[Matrix]:
        return [] if reduction is None else [modes_at(one, k, reduction) for one in like]

    def made(k: int, reduction: Reduction | None) -> tuple[Structure, Matrix]:
        columns, more = _columns(at, loads, flow, spread, k)
        key = f"{content} {reduction} {k}{more}"
        how, known = (reduction, damping), partial(others, k, reduction)
        make = partial(_kept, sector, kept, k, how, columns, (key, store), known)
        with step(
            f"reducing wave {k} of a sector: {model.places.n} dofs to {kept.size} of contacts, loads and outputs, and modes"
        ):
            return _remembered(memo, key, store, make)

    def wave(k: int, reduction: Reduction | None) -> tuple[Structure, Matrix]:
        if 2 * k <= sector.sectors or not mirrored:
            return made(k, reduction)
        structure, load = made(sector.sectors - k, reduction)
        return conjugate(structure), np.conj(load)

    waves = {k: wave(k, reduction) for k in numbers}
    most = max(structure.n for structure, _ in waves.values())
    if reduction is not None and any(structure.n < most for structure, _ in waves.values()):
        # all waves get as many coordinates as the wave that needs most
        alike = replace(reduction, n_modes=most - kept.size)
        waves = {k: wave(k, alike) for k in numbers}
    bases = {k: own.basis for k, (own, _) in waves.items()}
    waves = {k: (replace(own, basis=None), load) for k, (own, load) in waves.items()}
    parted = _parted(waves, flow, spread.shape[1], alone=loads.ndim == 1)
    return SectorWaves(sector, kept, *parted, bases)


def _remembered(
    memo: dict[Any, Any], key: str, store: Store, make: Callable[[], tuple[Structure, Matrix]]
) -> tuple[Structure, Matrix]:
    """Return a wave, from memory if it is cached; waves with maps to all dofs are large, and not cached."""
    if store is with_ways_back:
        return make()
    if key not in memo:
        memo[key] = make()
        forget(memo, tuple, REMEMBERED)
    found: tuple[Structure, Matrix] = memo[key]
    return found


def _spread(model: Model) -> FloatArray:
    """Return the real parts of the loads of `Model.spread` on the dofs of all parts, then the imaginary ones, (N, 2 l)."""
    own = [force_of(model.places, name, model.loads[name]) for name in model.spread]
    forces = np.array(own).reshape(len(own), model.places.n).T
    return np.hstack([forces.real, forces.imag])


def _columns(at: Coordinates, loads: Matrix, flow: Flow | None, spread: FloatArray, k: int) -> tuple[Matrix, str]:
    """Return loads, followed by force patterns of the fluid and spread loads on a wave.

    Also return a hash of patterns and spread loads.
    """
    if flow is None and not spread.size:
        return loads, ""
    patterns = at.load(spread if flow is None else np.hstack([flow.patterns(k), spread]))
    if loads.ndim == 1:
        columns = np.column_stack([loads, patterns])
    else:
        columns = scipy.sparse.hstack([loads, scipy.sparse.csr_array(patterns)], format="csr")
    return columns, content_hash(patterns)


def _parted(
    waves: Mapping[int, tuple[Structure, Matrix]], flow: Flow | None, spread: int, *, alone: bool
) -> tuple[Mapping[int, tuple[Structure, Matrix]], dict[int, Feedback], dict[int, Matrix]]:
    """Separate the columns of `_columns`: return waves with their loads, aerodynamic forces, and spread loads.

    With `alone`, a single load becomes one row.
    """
    felt = 0 if flow is None else flow.influence.patterns
    if not felt + spread:
        return waves, {}, {}
    rest, forces, fields = {}, {}, {}
    for k, (own, columns) in waves.items():
        first = columns.shape[1] - felt - spread
        rest[k] = own, columns[:, 0] if alone else columns[:, :first]
        behind = as_array(columns[:, first:])
        if flow is not None:
            forces[k] = flow.on(k, behind[:, :felt])
        real, imaginary = np.hsplit(behind[:, felt:], 2)
        fields[k] = real + 1j * imaginary
    return rest, forces, fields


def _content_of(model: Model, like: Sequence[Spin], wheel: Sequence[Any], kept: IntArray) -> str:
    """Return a hash of the inputs of the modes at other speeds; empty without such modes."""
    if not like:
        return ""
    parts = [part.structure for part in model.parts.values()]
    turning = [(one.speed, one.tangent, one.coriolis) for one in like]
    return content_hash(*wheel, kept, *parts, str(turning))


def _sector_at_speed(model: Model, spin: Spin) -> tuple[Structure, FloatArray]:
    """Return all parts together at a speed, damped, and the load of steady rotation on them."""
    rest = model.steady
    own: dict[str, Structure] = {}
    steady = []
    for name, part in model.parts.items():
        turning = at_speed(name, part, spin, rest[name])
        steady.append(steady_load(part, spin, turning, rest[name]))
        own[name] = damped(name, part, turning)
    return join(**own), np.concatenate(steady)


def _reduction(model: Model) -> tuple[Reduction | None, Damping | DampingOfParts | None, IntArray]:
    """Return the reduction and the modal damping of all waves, and the dofs of parts that are not reduced.

    Raises
    ------
    InputError
        If parts have different reductions, since a wave is reduced as a whole.
    """
    bodies = {name: part for name, part in model.parts.items() if part.body is None}
    ways = {name: part.reduction for name, part in bodies.items() if part.reduction is not None}
    empty = np.zeros(0, dtype=np.int64)
    damping = damping_by_modes(bodies, reduced=bool(ways))
    if not ways:
        return None, damping, empty
    follow = empty if model.neighbours is None else model.neighbours.followers
    whole = [
        np.setdiff1d(model.places.own(name), follow) for name, part in model.parts.items() if part.reduction is None
    ]
    return _one_of(ways), damping, np.concatenate([empty, *whole])


def _one_of(ways: Mapping[str, Any]) -> Reduction:
    """Return the reduction of all parts together: numbers of modes add up, everything else must be the same."""
    for name, way in ways.items():
        if not isinstance(way, Reduction):
            raise input_error(
                f"part.{name}.reduction",
                f"is a {type(way).__name__}, and the waves of a wheel are reduced by craig_bampton or rubin",
                "Choose one of them, or reduce the sector before it becomes a part.",
            )
    (first, one), *others = ways.items()
    total = one.n_modes
    for name, other in others:
        counts = isinstance(total, int) and isinstance(other.n_modes, int)
        if other.method != one.method or (not counts and other.n_modes != one.n_modes):
            raise input_error(
                f"part.{name}.reduction",
                f"differs from that of part.{first}, and on a wheel all parts of a sector are reduced together, wave by wave",
                "Give them the same method, and the same frequency or numbers of modes, which are added.",
            )
        if counts:
            total += other.n_modes
    return Reduction(total, one.method)


def damping_by_modes(parts: Mapping[str, Part], *, reduced: bool) -> Damping | DampingOfParts | None:
    """Return the modal damping of the waves of a sector; None without modal damping."""
    found = [part.damping if part.damping and part.damping.is_modal else None for part in parts.values()]
    for name, own in zip(parts, found, strict=True):
        if own != found[0]:
            if not reduced:
                return DampingOfParts(tuple(zip(parts, found, strict=True)))
            raise input_error(
                f"part.{name}.damping",
                "differs, and on a wheel all parts of a sector have their modes together",
                "Give all parts the same damping by modes or another form, or reduce none.",
            )
    return found[0] if found else None


def _kept(
    sector: CyclicSector,
    kept: IntArray,
    k: int,
    how: tuple[Reduction | None, Damping | DampingOfParts | None],
    steady: Matrix,
    where: tuple[str, Store],
    others: Callable[[], Sequence[Matrix]] = list,
) -> tuple[Structure, Matrix]:
    def make() -> tuple[Structure, Matrix]:
        try:
            made = reduced_wave(sector, kept, k, how, steady, others())
        except InputError as error:
            raise error.inside(f"wave {k}") from None
        whole = where[1] is with_ways_back
        return made if whole else (replace(made[0], basis=None), made[1])

    if how[0] is None or where[1] is with_ways_back:
        return make()
    values = where[1](where[0], lambda: packed(*make()))
    return unpacked(values, sector.structure, kept)
