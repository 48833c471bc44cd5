"""Aerodynamic forces on a model at a speed, wave by wave."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix
from stickslip.assembly.fluid.aerodynamics import Aerodynamics
from stickslip.assembly.forces import Load, force_at
from stickslip.assembly.locations import AXES
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import Store, in_memory
from stickslip.errors import InputError, input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import LinearSide
from stickslip.model.modes import normal_modes, submatrix
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.aerodynamics import Feedback, InfluenceCoefficients
from stickslip.reduction.cache import content_hash
from stickslip.reduction.waves import wave
from stickslip.response.equilibrium import preload
from stickslip.response.system import System

TIE = 1e-4  # largest relative difference of components of a mode that count as equal when its phase is fixed


@dataclass(frozen=True, eq=False)
class Flow:
    """Aerodynamic force on a model at a speed; build it with `build.flow_around`.

    Parameters
    ----------
    model
        The model.
    speed
        Rotor speed, rad/s.
    influence
        Influence coefficients at this speed.
    holds
        (p,) contact points that stick in the modes of the waves.
    store
        As in `assemble`.
    """

    model: Model
    speed: float
    influence: InfluenceCoefficients
    holds: BoolArray
    store: Store = in_memory

    def patterns(self, wave_number: int) -> Matrix:
        """Return the (N, m) force patterns of a wave on the dofs of all parts.

        Waves k and n_s − k have conjugate patterns.
        """
        given, sectors = self.given, self.model.sectors
        number = wave_number % sectors
        if given.of_points:
            return np.column_stack([self._point(name) for name in given.points])
        if given.shapes == "blade_alone":
            return self._remembered("alone", self._of_blade)
        if given.shapes == "nodal_diameter":
            return self._remembered("one", lambda: self._of_wave(given.nodal_diameter))
        if 2 * number > sectors:
            return np.conj(self.patterns(sectors - number))
        return self._remembered(f"{number}", lambda: self._of_wave(number))

    def on(self, wave_number: int, patterns: Matrix) -> Feedback:
        """Return the force on a wave from the force patterns in the coordinates of the wave."""
        angle = wave(wave_number, self.model.sectors).phase_angle
        return Feedback(patterns, angle, self.influence, self.given.reference)

    def on_structure(self, wave_number: int, moving: Structure) -> Feedback:
        """Return the force on a wave whose `basis` maps to the dofs of all parts, as from `Model.at`."""
        return self.on(wave_number, np.asarray(moving.project(self.patterns(wave_number))))

    @property
    def given(self) -> Aerodynamics:
        """Aerodynamics of the model."""
        assert self.model.aerodynamics is not None
        return self.model.aerodynamics

    @cached_property
    def _whole(self) -> Structure:
        return self.model.full(self.speed)

    def _point(self, name: str) -> FloatArray:
        on, direction = self.given.points[name]
        load = Load(on=on, newton=1.0, direction=direction, harmonic=0)
        return np.asarray(force_at(self.model.places, f"aero.points.{name}", load))

    def _of_wave(self, number: int) -> Matrix:
        """Return ``M φ`` of the modes of a wave; real modes if they are used for all waves."""
        moving = self.model.at(self.speed, number, self.holds)
        modes = self._modes(moving, f"modes of wave {number}")
        shapes = np.asarray(moving.expand(modes))
        shapes = shapes * phases(shapes, own_dofs(self.model))
        mass = self._whole.mass
        if self.given.shapes == "nodal_diameter":
            shapes = shapes.real
            shapes = shapes / np.sqrt(np.sum(shapes * (mass @ shapes), axis=0))
        return np.asarray(mass @ shapes) / self._scale(shapes)

    def _of_blade(self) -> Matrix:
        """Return ``M φ`` of the modes of a part with its root and its cyclic faces held, zero on all other parts."""
        model, clamped = self.model, self.given.clamped
        spot = model.places.spot(clamped, "aero.clamped")
        part, own = model.parts[spot.part], model.places.own(spot.part)
        held = spot.dofs if spot.nodes is None else spot.nodes[spot.nodes >= 0]
        faces = [own[part.structure.sets[f]] for f in part.faces if f in part.structure.sets]
        free = np.setdiff1d(own, np.concatenate([held, *faces]))
        whole = self._whole
        mass, damping, stiffness = (_taken(m, free) for m in (whole.mass, whole.damping, whole.stiffness))
        alone = Structure(mass, damping, stiffness, whole.dofs.take(free))
        shapes, patterns = np.zeros((2, whole.n, len(self.given.modes)))
        shapes[free] = self._modes(alone, f"modes of {clamped!r} held")
        shapes = shapes * phases(shapes, free).real
        patterns[free] = alone.mass @ shapes[free]
        return np.asarray(patterns / self._scale(shapes))

    def _modes(self, structure: Structure, what: str) -> Matrix:
        numbers = np.array(self.given.modes)
        if (most := int(np.count_nonzero(structure.mass.diagonal()))) < numbers.max():
            raise input_error(
                "aero.mode",
                f"is {numbers.max()}, and of the {what} there are {most}",
                f"Name modes up to {most}, here or in the columns force_mode and motion_mode of aero.file.",
            )
        try:
            return normal_modes(structure, int(numbers.max())).shapes[:, numbers - 1]
        except InputError as error:
            raise error.inside(f"aero: {what}") from None

    def _scale(self, shapes: Matrix) -> FloatArray:
        """Return the factors (m,) from these modes of unit mass to the modes of the user."""
        given, places = self.given, self.model.places
        if given.largest_displacement is None:
            return np.ones(shapes.shape[1])
        seen = np.arange(places.n)
        if given.over:
            places.part_of(given.over, "aero.over")
            seen = places.own(given.over)
        largest = largest_displacements(places.dofs.take(seen), shapes[seen])
        return np.asarray(given.largest_displacement / largest)

    def _remembered(self, what: str, make: Callable[[], Matrix]) -> Matrix:
        """Return patterns from memory or store, by the content of their inputs."""
        content = f"{self._content} {what}"
        memo: dict[Any, Any] = next(iter(self.model.parts.values())).memo
        if content not in memo:
            memo[content] = self.store(content, lambda: {"patterns": make()})["patterns"]
        return np.asarray(memo[content])

    @cached_property
    def _content(self) -> str:
        given, model = self.given, self.model
        what = (given.shapes, given.nodal_diameter, given.clamped, given.largest_displacement, given.over)
        here, pairs = model.neighbours, model.pairs
        pressed = self.holds if given.contacts == "static" and pairs.names else None
        met = (pairs.own, pairs.following, repr(pairs.laws), given.contacts, pressed)
        faces = () if here is None else (here.low, here.high, here.weights, here.ahead)
        tie = model.coordinates.tie
        return content_hash("aero: phases of own dofs", self._whole, model.sectors, given.modes, what, met, faces, tie)


def own_dofs(model: Model) -> IntArray:
    """Return the sector's own dofs of all parts, without those that follow a neighbour."""
    here = model.neighbours
    following = np.zeros(0, dtype=np.int64) if here is None else np.setdiff1d(here.followers, here.leaders)
    return np.setdiff1d(np.arange(model.places.n), following)


def phases(shapes: Matrix, own: IntArray) -> ComplexArray | FloatArray:
    """Return the (m,) factors that make the largest component of each shape (n, m) on the dofs `own` real and positive.

    Among components that are equal to within `TIE` the first one is taken, so that rounding does not decide.
    """
    sizes = np.abs(shapes[own])
    top = own[(sizes >= (1 - TIE) * sizes.max(axis=0)).argmax(axis=0)]
    leading = shapes[top, np.arange(shapes.shape[1])]
    return np.asarray(np.conj(leading) / np.abs(leading))


def largest_displacements(table: Dofs, shapes: Matrix) -> FloatArray:
    """Return the (m,) largest nodal displacements of shapes (n, m). A dof without a node counts separately."""
    along = np.isin(np.array(table.component), AXES)
    parts = np.array(table.part) if table.part else np.full(len(table), "")
    squares = np.abs(shapes) ** 2
    alone = squares[~along & (table.node < 0)]
    names = list(dict.fromkeys(zip(parts[along], table.node[along].tolist(), strict=True)))
    place: dict[Any, int] = {name: i for i, name in enumerate(names)}
    index = np.array(
        [place[p, n] for p, n in zip(parts[along], table.node[along].tolist(), strict=True)], dtype=np.int64
    )
    sums = np.zeros((len(names), shapes.shape[1]))
    np.add.at(sums, index, squares[along])
    return np.asarray(np.sqrt(np.vstack([sums, alone]).max(axis=0)))


def about_static_state(system: System, load: HarmonicLoad, fluid: Matrix | None) -> HarmonicLoad:
    """Return the load with a static force that keeps the static state of the model without fluid.

    Aerodynamic coefficients describe the motion about the static state, which therefore must not change.

    Parameters
    ----------
    system
        System whose matrices include the frozen aerodynamic force.
    load
        Load whose static part leads to the static state.
    fluid
        (n, n) stiffness by which the frozen force changes the mean; None without a fluid.
    """
    if fluid is None:
        return load
    springs = scipy.sparse.csr_array(fluid)
    dry = replace(system, structure=system.structure.grounded(springs))
    moved = preload(dry, load.static)
    alone = dry.condensed(HarmonicLoad(load.static), 0)
    rest = alone.recover(0.0, moved[None].astype(complex))[0].real
    return replace(load, static=load.static - springs @ rest)


def fluid_of(side: LinearSide) -> Matrix | None:
    """Return the (n, n) stiffness by which the frozen force changes the mean of one sector; None without a fluid."""
    force = side.feedback_of(0)
    return None if force is None else force.stiffness().real


def _taken(matrix: Matrix, dofs: IntArray) -> Matrix:
    return submatrix(matrix.tocsr() if scipy.sparse.issparse(matrix) else matrix, dofs, dofs)
