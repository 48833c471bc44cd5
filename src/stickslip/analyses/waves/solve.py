"""The solution for one travelling wave: its modes at a speed, its branches over speeds, its flutter."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
import scipy

from stickslip.analyses.facts import NOTE, facts_of
from stickslip.analyses.waves.records import Crossing, WaveBranches, WaveFlutter, WaveModes, Wheel
from stickslip.analyses.waves.verdicts import static_doubts
from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix
from stickslip.assembly.build import flow_around, holding_points
from stickslip.assembly.fluid.aero_forces import own_dofs, phases
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.part_reduction import stiffening
from stickslip.assembly.sides.waves import damping_by_modes
from stickslip.assembly.statics import StaticState
from stickslip.errors import input_error
from stickslip.model.damping import Damping
from stickslip.model.modes import gyroscopic_modes, normal_modes
from stickslip.model.structure import Structure
from stickslip.reduction.speed_basis import speed_basis
from stickslip.reduction.wave_family import WaveFamily
from stickslip.response.rotating.campbell import campbell, stiffening_of
from stickslip.response.rotating.flutter import FlutterOfWave, damping_ratio, flutter_of_wave
from stickslip.study.analysis import Notes
from stickslip.study.store.progress import advance
from stickslip.study.verdict import Verdict, doubt, to_json
from stickslip.units import HZ, RPM

STATIC = ("static_rpm", "static_displacement_m", "static_strain", "static_rotation_rad")
FLUID = "the aerodynamic coefficients play no part: frequencies are those in still fluid"
ALIKE = "mistuning plays no part; the frequencies belong to the wheel with all sectors alike"


def in_still_fluid(model: Model) -> tuple[Model, tuple[Verdict, ...]]:
    """Return the model of a diagram of tuned waves in still fluid, and a list of the neglected effects."""
    found = []
    if model.aerodynamics is not None:
        remedy = "[modes] has the frequencies in the flow at one speed, [flutter] the damping."
        found.append(Verdict("trusted", why=FLUID, remedy=remedy))
    if model.mistuning is not None:
        remedy = "[modes] has the frequencies of the wheel as it is at one speed."
        found.append(Verdict("trusted", why=ALIKE, remedy=remedy))
    return model.without_aerodynamics(), tuple(found)


def wave_in_flow(
    model: Model, contacts: ContactsAs, speed: float, wave_number: int, n_modes: int
) -> FlutterOfWave | None:
    """Return the modes of a wave with the aerodynamic forces of the model; None if it has none.

    Parameters
    ----------
    model, contacts
        The model, and the state of its contacts.
    speed
        Speed in rad/s.
    wave_number
        Wave number.
    n_modes
        Number of modes.
    """
    flow = flow_around(model, speed=speed)
    if flow is None:
        return None
    moving = model.at(speed, wave_number, holding_points(model, contacts), with_damping=True)
    parts = {k: p for k, p in model.parts.items() if p.body is None}
    reduced = any(part.reduction is not None for part in parts.values())
    damping = damping_by_modes(parts, reduced=reduced)
    ratios: float | tuple[float, ...] = 0.0
    if isinstance(damping, Damping):
        ratios = damping.modal or 0.0
    elif damping is not None:
        moving = damping.of_modes(moving)
    feedback = flow.on_structure(wave_number, moving)
    return flutter_of_wave(moving, feedback, n_modes, ratios=ratios)


FEW = 300  # dofs of a sector, up to which all waves are solved quickly
MANY = 2000  # dofs of a sector, above which every wave has more modes than a study may request

W = TypeVar("W", WaveModes, WaveBranches, WaveFlutter)


@dataclass(frozen=True, eq=False)
class Question:
    """Inputs of a computation of modes or branches; picklable.

    Parameters
    ----------
    model
        The model.
    contacts
        State of its contacts.
    wheel
        Number of sectors, and whether directions are split.
    numbers
        Wave numbers.
    n_modes
        Modes of each wave.
    speeds
        Speeds in rad/s; one for modes, ascending for branches.
    rpm
        Speed as shown in the result; NaN for a range.
    shapes
        Whether mode shapes are kept.
    engine_orders
        Engine orders whose crossings are sought.
    left_out
        Effects that the frequencies neglect, in words.
    """

    model: Model
    contacts: ContactsAs
    wheel: Wheel
    numbers: tuple[int, ...]
    n_modes: int
    speeds: tuple[float, ...]
    rpm: float = math.nan
    shapes: bool = False
    engine_orders: tuple[int, ...] = ()
    left_out: tuple[Verdict, ...] = ()

    @property
    def turning(self) -> bool:
        """Whether Coriolis forces act at the first speed; aerodynamic forces split the directions of waves as well."""
        return self.model.coriolis and self.model.rotates and self.speeds[0] > 0

    @property
    def small(self) -> bool:
        """Whether a wave may have too few modes, and can be checked quickly."""
        return own_dofs(self.model).size <= MANY

    def require(self, place: str) -> None:
        """Refuse more modes than a wave has."""
        for number in self.numbers:
            mass = self.at(self.speeds[0], number).mass.diagonal()
            most = int(np.count_nonzero(mass))
            if self.n_modes > most:
                raise input_error(
                    place,
                    f"is {self.n_modes}, and the wave {number} has {most} modes",
                    f"Ask for {most} at most." if most else "Free a part of it.",
                )

    def require_coefficients(self) -> None:
        """Refuse aerodynamic coefficients that do not cover the natural frequencies, if these can be found quickly."""
        given = self.model.aerodynamics
        if given is None or not given.influence.refuses or own_dofs(self.model).size > FEW:
            return
        waves = (self.at(self.speeds[0], number) for number in self.numbers)
        squares = [normal_modes(moving, self.n_modes).squares for moving in waves]
        omega = np.sqrt(np.maximum(squares, 0.0))
        low, high = float(omega.min()), float(omega.max())
        given.influence.require(low, high, f"the question for {self.n_modes} modes of each wave")

    @cached_property
    def holds(self) -> BoolArray:
        """(p,) contact points that stick in these vibrations."""
        return holding_points(self.model, self.contacts)

    def at(self, speed: float, wave_number: int) -> Structure:
        """Return the structure of a wave at a speed in rad/s."""
        return self.model.at(speed, wave_number, self.holds)

    @cached_property
    def stiffening(self) -> Matrix:
        """Derivative of the stiffness with respect to Ω² at the first speed, on the dofs of all parts; the same for all waves."""
        model, spin = self.model, self.model.spin(self.speeds[0])
        own = [stiffening(part, spin, model.steady[name]) for name, part in model.parts.items()]
        return scipy.sparse.block_diag(own, format="csr")

    @cached_property
    def family(self) -> WaveFamily:
        """The waves at the first speed; they share one factorisation of the interior."""
        return WaveFamily(partial(self.at, self.speeds[0]), self.wheel.sectors, self.numbers)


def about(
    model: Model, contacts: ContactsAs, rpm: float, highest: float, more: Sequence[Verdict] = ()
) -> dict[str, Any]:
    """Return the note about a model.

    Parameters
    ----------
    model
        The model.
    contacts
        State of its contacts: stuck, sliding or open.
    rpm
        Speed of the rotor; NaN for a range.
    highest
        Speed of the reported static displacement, rad/s.
    more
        Additional entries of the note.
    """
    state = model.static_state(highest)
    doubts = static_doubts(state, contacts=bool(model.contacts))
    note = facts_of(model, rpm) | {
        "speed_rpm": rpm,
        "contacts": contacts if model.contacts else "none",
        "verdicts": to_json([*map(doubt, model.warnings), *doubts, *more]),
    }
    return note | _static(state)


def _static(state: StaticState | None) -> dict[str, float]:
    if state is None:
        return dict.fromkeys(STATIC, np.nan)
    found = state.speed / RPM, state.displacement, state.strain, state.rotation
    return dict(zip(STATIC, found, strict=True))


def skin_note(model: Model) -> dict[str, Any]:
    """Return the note about the skin, for drawings of mode shapes."""
    skin = model.skin
    assert skin is not None
    return {"skin_point": skin.points, "skin_triangle": skin.triangles, "skin_cut": skin.cut}


def each_wave(solve: Callable[[Question, int], W], asked: Question, done: Sequence[W], notes: Notes) -> Iterator[W]:
    """Yield the records of unfinished waves; the note about the model comes first."""
    if notes.get(NOTE) is None:
        note = about(asked.model, asked.contacts, asked.rpm, asked.speeds[-1], asked.left_out)
        note |= {"parted": asked.wheel.parted}
        notes.put(NOTE, note | (skin_note(asked.model) if asked.shapes else {}))
    known = {w.wave_number for w in done}
    for i, number in enumerate(asked.numbers):
        if number not in known:
            found = solve(asked, number)
            yield found
            advance((i + 1) / len(asked.numbers), _progress(found))


def _progress(wave: WaveModes | WaveBranches | WaveFlutter) -> str:
    low, high = wave.frequencies_hz.min(), wave.frequencies_hz.max()
    basis = f", basis good to {wave.error:.0e}" if isinstance(wave, WaveBranches) else ""
    return f"wave number {wave.wave_number}: {low:.6g} to {high:.6g} Hz in {wave.seconds:.1f} s{basis}"


def solve_wave(asked: Question, wave_number: int) -> WaveModes:
    """Return the lowest modes of a wave.

    Raises
    ------
    InputError
        If the wave has fewer modes.
    """
    began = perf_counter()
    structure = asked.at(asked.speeds[0], wave_number)
    shift, factors = asked.family.shifted(wave_number, structure)
    if asked.turning:
        turning = gyroscopic_modes(structure, asked.n_modes, shift=shift, factors=factors)
        hertz, vectors = turning.frequencies_hz, turning.shapes
    else:
        modes = normal_modes(structure, asked.n_modes, shift=shift, factors=factors)
        hertz, vectors = modes.frequencies_hz, np.asarray(modes.shapes, dtype=complex)
    moved = np.zeros((asked.n_modes, 0, 3), dtype=complex)
    if asked.shapes:
        moved = asked.model.on_skin(np.asarray(structure.expand(vectors), dtype=complex))
        moved = unit_shapes(moved, _own_points(asked.model))
    growth: FloatArray = np.zeros(asked.n_modes)
    if asked.speeds[0] and asked.model.rotates:
        growth = stiffening_of(structure, hertz, vectors, asked.stiffening, asked.speeds[0], turning=asked.turning)
    flow = wave_in_flow(asked.model, asked.contacts, asked.speeds[0], wave_number, asked.n_modes)
    seconds = perf_counter() - began
    found = WaveModes(wave_number=wave_number, seconds=seconds, frequencies_hz=hertz, growth=growth, shapes=moved)
    if flow is None:
        return found
    return replace(found, damping=damping_ratio(flow.damped), damped_hz=flow.damped.imag / HZ)


def _own_points(model: Model) -> IntArray:
    """Return the skin points that do not depend on the neighbouring sector; points of the high cyclic face do."""
    following = np.ones((model.places.n, 1))
    following[own_dofs(model)] = 0.0
    return np.flatnonzero(~model.on_skin(following).any(axis=(0, 2)))


def unit_shapes(shapes: ComplexArray, own: IntArray) -> ComplexArray:
    """Return shapes (m, n, 3) whose largest displacement has length 1; the largest component among the points `own` is real and positive."""
    out = np.zeros_like(shapes)
    components = (3 * own[:, None] + np.arange(3)).ravel()
    for i, shape in enumerate(shapes):
        if shape[own].any():
            flat = shape.reshape(-1, 1)
            out[i] = shape * (phases(flat, components) / np.linalg.norm(shape, axis=1).max())
    return out


def follow_wave(asked: Question, wave_number: int) -> WaveBranches:
    """Return the branches of a wave over the speeds and their crossings with the engine orders that excite it."""
    began = perf_counter()
    orders = [m for m in asked.engine_orders if asked.wheel.diagram(m) == wave_number]
    speeds, coriolis = np.array(asked.speeds), asked.wheel.parted
    small = speed_basis(
        lambda speed: asked.at(speed, wave_number),
        (asked.speeds[0], asked.speeds[-1]),
        asked.n_modes,
        coriolis=coriolis,
    )
    found = campbell(small.at, speeds, asked.n_modes, orders, coriolis=coriolis)
    return WaveBranches(
        wave_number=wave_number,
        seconds=perf_counter() - began,
        frequencies_hz=found.frequencies_hz,
        error=small.error,
        crossings=tuple(
            Crossing(mode=c.mode, engine_order=c.engine_order, speed_rpm=c.speed / RPM, frequency_hz=c.frequency_hz)
            for c in found.crossings
        ),
    )
