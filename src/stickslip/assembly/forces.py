"""Loads and outputs of a model, and forces of the loads on the dofs of all parts."""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.assembly.fluid.pressure import PressureField
from stickslip.assembly.locations import AXES, COMPONENTS, Places, Spot
from stickslip.errors import did_you_mean, input_error

# request for the error of all outputs, each as a vector: the error of the answer
ANSWER: tuple[tuple[str, ...], ...] = ((), ("answer",))
FAR = 0.1  # distance of an output from its node, as a share of the part's size, above which a warning is given
ALONG = 1e-6  # share of a direction below which a component counts as zero


@dataclass(frozen=True, kw_only=True)
class Load:
    """A static or harmonic force.

    Parameters
    ----------
    on
        ``part`` (a rigid body, at its centre of mass), ``part.set`` (shared equally among its nodes), or a dof
        ``part.node12.x``.
    newton
        Resultant force, or its amplitude, N.
    direction
        Unit vector in global axes (of the sector, on a wheel); None if `on` is a single dof.
    harmonic
        0: static; h: ``Re(newton e^{i(h ω t + phase)})``.
    phase
        In rad.
    engine_order
        Engine order m on a wheel: harmonic h travels as the wave ``h m``; 0: all sectors alike; None for a single
        structure.
    omega, omega_ratio
        Frequency of a load with its own frequency, rad/s, or its ratio to the frequency of the other loads; the motion
        then has two frequencies. None: the frequency of the other loads.
    field
        Pressure on the facets of a surface instead of a force; `newton` is then a factor, 1 for the whole field. None:
        a force.

    Raises
    ------
    InputError
        If the harmonic or the engine order is not a count, a number is not finite, or a static load has a phase or its
        own frequency.
    """

    on: str
    newton: float
    direction: tuple[float, float, float] | None = None
    harmonic: int = 1
    phase: float = 0.0
    engine_order: int | None = None
    omega: float | None = None
    omega_ratio: float | None = None
    field: PressureField | None = None

    def __post_init__(self) -> None:
        for name, least in (("harmonic", 0), ("engine_order", 0)):
            value = getattr(self, name)
            if value is not None and (not isinstance(value, int | np.integer) or value < least):
                raise input_error(f"Load.{name}", f"must be an integer from {least} on, got {value!r}", "Give a count.")
        if not (math.isfinite(self.newton) and math.isfinite(self.phase)):
            raise input_error("Load", f"has {self.newton} N and a phase of {self.phase} rad", "Give finite numbers.")
        own = [v for v in (self.omega, self.omega_ratio) if v is not None]
        if len(own) > 1 or any(not (math.isfinite(v) and v > 0.0) for v in own) or (own and not self.harmonic):
            raise input_error(
                "Load.omega",
                f"is {self.omega} rad/s and omega_ratio {self.omega_ratio}, for a load in harmonic {self.harmonic}",
                "Give one of the two, above zero, and harmonic 1 or more.",
            )
        if self.harmonic == 0 and self.phase:
            raise input_error(
                "Load.phase", f"is {self.phase:g} rad of a static load", "Leave it out, or give a harmonic from 1 on."
            )

    @property
    def second(self) -> bool:
        """Whether the load has its own frequency."""
        return self.omega is not None or self.omega_ratio is not None


@dataclass(frozen=True, kw_only=True)
class Output:
    """Point whose motion is reported.

    Parameters
    ----------
    name
        Name of the output; its labels are ``name.x`` and so on.
    on
        ``part.set`` (its first node), a dof ``part.node12.x``, or a part together with `near`.
    near
        (3,) position in m; the nearest node of the part `on` is taken.
    directions
        Reported components, from x, y, z, rx, ry, rz; empty: all components of the point.
    """

    name: str
    on: str
    near: tuple[float, float, float] | None = None
    directions: tuple[str, ...] = ()


def force_of(places: Places, name: str, load: Load) -> Matrix:
    """Return the (N,) force of a load, complex if it has a phase; see `force_at`."""
    return force_at(places, f"load.{name}", load)


def amplitude(places: Places, name: str, load: Load) -> float:
    """Return the magnitude of a whole load, N."""
    if load.field is None:
        return abs(load.newton)
    key = f"load.{name}.on"
    return abs(load.newton) * load.field.on(places, load.on, key).newton


def force_at(places: Places, key: str, load: Load) -> Matrix:
    """Return the (N,) force of the load at a study `key`.

    Raises
    ------
    InputError
        If the place does not exist or cannot move, or the direction is missing.
    """
    amplitude = load.newton * (cmath.exp(1j * load.phase) if load.phase else 1.0)
    if load.field is not None:
        spread = load.field.on(places, load.on, f"{key}.on").force
        return amplitude * (spread if load.harmonic else spread.real)
    spot = places.spot(load.on, f"{key}.on")
    force = np.zeros(places.n, dtype=type(amplitude))
    if spot.surface is None:
        _refuse_direction(places, key, load, spot)
        force[spot.dofs] = amplitude / spot.dofs.size
        return force
    unit = _unit(key, load)
    points = len(spot.surface.points)
    shape = spot.surface.displacement.T @ np.tile(unit / points, points)
    stuck = [axis for i, axis in enumerate(AXES) if abs(unit[i]) > ALONG and not _moves(spot, i)]
    if not np.any(shape) or stuck:
        along = stuck[0] if len(stuck) == 1 and np.any(shape) else unit.tolist()
        raise input_error(
            f"{key}.on",
            f"{load.on!r} cannot move along {along}",
            "Choose a place that is not clamped, or another direction.",
        )
    return amplitude * shape


def _moves(spot: Spot, axis: int) -> bool:
    """Return whether a point of a spot can move along an axis."""
    assert spot.surface is not None
    return bool(abs(spot.surface.displacement[axis::3]).max() > 0)


def _refuse_direction(places: Places, key: str, load: Load, spot: Spot) -> None:
    """Refuse a load on single dofs with another direction than theirs, along which the whole force acts."""
    if load.direction is None:
        return
    own = {places.dofs.component[dof] for dof in spot.dofs}
    unit = _unit(key, load)
    if any(axis not in AXES or abs(unit[AXES.index(axis)] - 1) > ALONG for axis in own):
        raise input_error(
            f"{key}.direction",
            f"is given, but {load.on!r} is a single dof, or several, of direction {', '.join(sorted(own))}",
            "Leave it out; the force acts along the dof with the sign of force_n. Or name a node that can move so.",
        )


def _unit(key: str, load: Load) -> FloatArray:
    if load.direction is None:
        raise input_error(f"{key}.direction", "is missing", 'Give "x", "y", "z" or three numbers.')
    vector = np.asarray(load.direction, dtype=float)
    length = float(np.linalg.norm(vector))
    if vector.shape != (3,) or not 0 < length < np.inf:
        raise input_error(f"{key}.direction", f"is no direction: {load.direction}", "Give three numbers.")
    return np.asarray(vector if abs(length - 1.0) < 1e-12 else vector / length)


class Driving(Protocol):
    """Harmonic and engine order of a load."""

    @property
    def harmonic(self) -> int:
        """Multiple of the load's engine order; 0: static."""
        ...

    @property
    def engine_order(self) -> int | None:
        """As in `Load`."""
        ...


def engine_order(loads: Mapping[str, Driving], wheel: bool) -> tuple[int | None, dict[str, int]]:
    """Return the base engine order of the loads, and the harmonic of each load.

    If all loads have the same engine order, it is the base. Otherwise the base is the greatest common divisor m_0 of
    the orders ``harmonic · engine_order``: a load of order m acts in harmonic m/m_0 of the frequency m_0 Ω, and travels
    as the wave m.

    Returns
    -------
    order
        Base order; None for a single structure, and without harmonic loads.
    harmonics
        Harmonic of each load; 0 for static loads.

    Raises
    ------
    InputError
        If a load on a sector has no engine order, or a load on a single structure has one; if only some loads have
        order 0.
    """
    found: dict[str, int] = {}
    for name, load in loads.items():
        order = load.engine_order
        if order is not None and not wheel:
            raise input_error(
                f"load.{name}.engine_order",
                f"is {order}, and the model is no sector of a wheel",
                "Give a part its number of sectors, or leave the engine order out.",
            )
        if load.harmonic > 0 and order is None and wheel:
            raise input_error(
                f"load.{name}.engine_order",
                "is missing: on a wheel a harmonic force is a wave",
                "Give the engine order m; harmonic h travels as the wave h m.",
            )
        if order is not None and load.harmonic > 0:
            found[name] = order
    own = {name: load.harmonic for name, load in loads.items()}
    if len(set(found.values())) < 2:
        return next(iter(found.values()), None), own
    if 0 in found.values():
        listed = ", ".join(f"load.{name}: {order}" for name, order in found.items())
        raise input_error(
            "load",
            f"has engine order 0 beside others ({listed}): what all sectors feel alike has no speed that it goes with",
            "Study it by itself.",
        )
    base = math.gcd(*(own[name] * order for name, order in found.items()))
    return base, own | {name: own[name] * order // base for name, order in found.items()}


@dataclass(frozen=True, eq=False)
class Labels:
    """Names of reported dofs.

    Parameters
    ----------
    names
        Labels such as ``tip1.x``.
    dofs
        (k,) dofs of all parts.
    """

    names: tuple[str, ...]
    dofs: IntArray

    def of(self, names: tuple[str, ...], place: str) -> IntArray:
        """Return the dofs of some of the names; an `InputError` at `place` suggests similar names."""
        at = dict(zip(self.names, self.dofs, strict=True))
        for name in names:
            if name not in at:
                raise input_error(place, f"there is no place {name!r}", did_you_mean(name, list(at)))
        return np.array([at[name] for name in names], dtype=np.int64)


def output_labels(places: Places, outputs: tuple[Output, ...], loads: Mapping[str, Load]) -> Labels:
    """Return the reported dofs: the outputs, or without outputs the dofs under harmonic loads.

    Raises
    ------
    InputError
        If a place does not exist, is clamped, or lacks a requested direction.
    """
    if not outputs:
        vibrating = {name: load for name, load in loads.items() if load.harmonic > 0}
        outputs = tuple(Output(name=name, on=load.on) for name, load in vibrating.items())
    names: list[str] = []
    dofs: list[int] = []
    for output in outputs:
        for component, dof in _of_output(places, output):
            names.append(f"{output.name}.{component}")
            dofs.append(dof)
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise input_error("output.points", f"has {twice[0]!r} twice", "Name each point once.")
    return Labels(tuple(names), np.array(dofs, dtype=np.int64))


def _of_output(places: Places, output: Output) -> list[tuple[str, int]]:
    key = f"output.points.{output.name}"
    components = np.array(places.dofs.component)
    if output.near is not None:
        rows = _nearest(places, output, key)
    else:
        spot = places.spot(output.on, key)
        if spot.surface is None:
            return [(str(components[dof]), int(dof)) for dof in spot.dofs[:1]]
        rows = _first(places, spot)
    has = {c: int(row) for c, row in zip(COMPONENTS, rows, strict=True) if row >= 0}
    wanted = output.directions or tuple(has)
    lost = [c for c in wanted if c not in has]
    if lost or not has:
        raise input_error(
            key,
            f"{output.on!r} has no {lost[0] if lost else 'coordinates: it is clamped'}",
            f"It moves along {', '.join(has)}." if has else "Choose a place that can move.",
        )
    return [(c, has[c]) for c in wanted]


def _first(places: Places, spot: Spot) -> IntArray:
    """Return the dofs of a spot's first node, or of its rigid body."""
    part = places.parts[spot.part]
    if part.body is not None:
        return places.own(spot.part)
    assert spot.surface is not None
    assert spot.surface.numbers is not None
    return np.asarray(places.rows(spot.part, spot.surface.numbers[:1])[0])


def first_nodes(places: Places, outputs: tuple[Output, ...]) -> tuple[str, ...]:
    """Return a line about each output on a set of several nodes, of which only the first is reported."""
    found = []
    for output in outputs:
        if output.near is None and places.parts[output.on.partition(".")[0]].body is None:
            surface = places.spot(output.on, f"output.points.{output.name}").surface
            if surface is not None and surface.numbers is not None and len(surface.numbers) > 1:
                at = ", ".join(f"{x:.6g}" for x in surface.points[0])
                found.append(
                    f"output {output.name}: the first of the {len(surface.numbers)} nodes of {output.on}, at ({at}) m"
                )
    return tuple(found)


def far_outputs(places: Places, outputs: tuple[Output, ...]) -> list[str]:
    """Return a warning about each output whose nearest node is far from the requested position."""
    found = []
    for output in outputs:
        if output.near is None or output.on not in places.parts:
            continue
        points = places.parts[output.on].structure.dofs.position
        points = points[np.isfinite(points).all(axis=1)]
        away = np.linalg.norm(points - np.asarray(output.near, dtype=float), axis=1)
        if points.size and away.min() > FAR * np.linalg.norm(np.ptp(points, axis=0)):
            found.append(
                f"output.points.{output.name}.near_m: the nearest node of {output.on} is {away.min():.3g} m away, at "
                f"{points[np.argmin(away)].tolist()} m. Is the place in metres?"
            )
    return found


def doubtful_fields(places: Places, loads: Mapping[str, Load]) -> list[str]:
    """Return the warnings about pressure fields."""
    return [
        f"load.{name}: {text}"
        for name, load in loads.items()
        if load.field is not None
        for text in load.field.on(places, load.on, f"load.{name}.on").warnings
    ]


def _nearest(places: Places, output: Output, key: str) -> IntArray:
    part = places.part_of(output.on, key)
    table = part.structure.dofs
    known = np.flatnonzero((table.node >= 0) & np.isfinite(table.position).all(axis=1))
    if not known.size:
        raise input_error(key, f"the part {output.on!r} has no nodes", "Name a dof or a set.")
    away = np.linalg.norm(table.position[known] - np.asarray(output.near, dtype=float), axis=1)
    return np.asarray(places.rows(output.on, table.node[known[[int(np.argmin(away))]]])[0])


def error_names(labels: Labels, contacts: Labels, loads: Mapping[str, Load], over: tuple[str, ...]) -> tuple[str, ...]:
    """Return the labels over which the truncation error is taken: by default all outputs."""
    if over in (*ANSWER, ("outputs",)):
        return labels.names
    if over == ("contacts",):
        return contacts.names
    if over != ("along",):
        return tuple(dict.fromkeys(over))
    axis = _axis_of_excitation(loads)
    along = tuple(name for name in labels.names if axis is not None and name.endswith(f".{axis}"))
    return along or labels.names


def _axis_of_excitation(loads: Mapping[str, Load]) -> str | None:
    driven = [load for load in loads.values() if load.harmonic > 0]
    if not driven:
        return None
    largest = max(driven, key=lambda load: abs(load.newton))
    if largest.direction is None:
        return largest.on.rpartition(".")[2]
    return AXES[int(np.argmax(np.abs(largest.direction)))]


def beyond_sectors(loads: Mapping[str, Load], sectors: int) -> list[str]:
    """Return a warning about engine orders that are not below the number of sectors, and act like lower ones."""
    return [
        f"load.{name}.engine_order is {load.engine_order}, and {sectors} sectors see it as {load.engine_order % sectors}; such a force varies within a sector, but is taken as constant over its place."
        for name, load in loads.items()
        if sectors > 1 and load.engine_order is not None and load.engine_order >= sectors
    ]


def refuse_second(loads: Mapping[str, Load]) -> None:
    """Refuse loads with their own frequency in analyses of one frequency."""
    own = next((name for name, load in loads.items() if load.second), None)
    if own is not None:
        raise input_error(
            f"load.{own}",
            "has a frequency of its own: the motion has two",
            "Ask [quasi_periodic] for it, or leave frequency_hz and frequency_ratio out.",
        )
