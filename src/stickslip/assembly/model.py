"""The model: parts, contacts and loads."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.assembly.assembled import Skin
from stickslip.assembly.contact import ALONE, NEXT, Contact, Join
from stickslip.assembly.fluid.aerodynamics import Aerodynamics
from stickslip.assembly.forces import Load, Output, beyond_sectors, doubtful_fields, engine_order, far_outputs
from stickslip.assembly.joints.cyclic_faces import uncoupled, untied_faces
from stickslip.assembly.joints.pairs import Pairs, pair_contacts
from stickslip.assembly.joints.surface_checks import refuse_contacts_of_dofs, refuse_joined
from stickslip.assembly.joints.ties import Coordinates, Ties, coordinates, tie_joins
from stickslip.assembly.locations import Places, picked
from stickslip.assembly.part_reduction import Spin, Steady, at_speed, damped, is_loaded, steady_of
from stickslip.assembly.sides.mistuning import Mistuning
from stickslip.assembly.sides.wheel import Neighbours, is_staged, neighbours, stages_of, with_joins
from stickslip.assembly.skin import on_skin, skin_of
from stickslip.assembly.statics import StaticState, joined_displacements, static_state
from stickslip.contact.law import check_law_members, held_stiffness
from stickslip.errors import check_choice, input_error, no_wheel
from stickslip.harmonic.rigid_contacts import STIFF
from stickslip.model.axis import Axis
from stickslip.model.facts import Facts, facts_of_parts, other_speeds, unlike_units
from stickslip.model.modes import with_springs
from stickslip.model.part import Part
from stickslip.model.structure import Structure, join
from stickslip.reduction.basis import in_coordinates, surviving_sets
from stickslip.reduction.coupled_stages import Multistage
from stickslip.reduction.cyclic import travelling_wave
from stickslip.reduction.waves import wave
from stickslip.response.forced.choices import AmplitudeOf

ContactsAs = Literal["static", "stuck", "open"]
TangentAtSpeed = Literal["consistent", "textbook"]
_UNCOUPLED = (
    "nothing couples the {} sectors: each vibrates alone. Name the cyclic faces of a part, or give a contact with a surface "
    '"next.part.surface".'
)


def without_bodies(structure: Structure, names: Collection[str]) -> Structure:
    """Return a structure without the coordinates of some parts; `basis` maps to all coordinates.

    Raises
    ------
    InputError
        If no coordinate is left.
    """
    if not names:
        return structure
    table = structure.dofs
    stays = np.array([part not in names for part in table.part])
    index = np.flatnonzero(stays)
    if not index.size:
        raise input_error(
            "part", "nothing is left without free rigid bodies", "Let contacts stick, or give a part that is held."
        )
    into = picked(np.where(stays, np.cumsum(stays) - 1, -1), index.size)
    if structure.basis is None:
        structure = replace(structure, basis=picked(np.arange(structure.n), structure.n))
    return in_coordinates(structure, into, table.take(index), surviving_sets(structure, index))


@dataclass(frozen=True, eq=False, kw_only=True)
class Model:
    """Any number of parts, the contacts between their surfaces, and the loads on them.

    Parameters
    ----------
    parts, contacts, joins, loads
        Parts, contacts, joins and loads by name.
    outputs
        Reported points; none: the points under harmonic loads. The peak is taken of the first label unless
        `peak_output` names another.
    peak_output, amplitude_of
        Label of the output whose peak is resolved (empty: the first one), and the definition of its amplitude:
        ``first``, ``half_peak_to_peak`` or ``rms``.
    alert_over
        Labels over which the truncation error is taken, or ``answer``, ``outputs``, ``contacts``, ``along``; empty:
        ``answer``.
    speed
        Rotor speed, rad/s.
    tangent, coriolis
        As in `RotatingSolid.at_speed`.
    centrifugal
        Whether the centrifugal load of rotating parts is a static load of the response.
    interface_modes
        Number of characteristic shapes that replace the nodes of joined surfaces of a single structure in the forced
        response; None: the nodes are kept.
    retention
        Stiffness of springs that keep the mean position of free rigid bodies, N/m.
    mistuning
        Differences between the sectors of a wheel; None: all are alike.
    modes_like
        Reference speeds of the reduction, rad/s. One: modal coordinates are rotated to the modes at this speed, so that
        reduced matrices change smoothly with the speed. Several: the span of the modes at all of them is kept. Empty:
        the modes at `speed`.
    aerodynamics
        Aerodynamic coupling of the blades of a wheel; None without a fluid. `at` neglects it.

    Raises
    ------
    InputError
        On first use of an inconsistent model. The message names the part, contact, join or load, and the reason.
    """

    parts: Mapping[str, Part]
    contacts: Mapping[str, Contact] = field(default_factory=dict)
    joins: Mapping[str, Join] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    outputs: tuple[Output, ...] = ()
    peak_output: str = ""
    amplitude_of: AmplitudeOf = "first"
    alert_over: tuple[str, ...] = ()
    speed: float = 0.0
    tangent: TangentAtSpeed = "consistent"
    coriolis: bool = False
    centrifugal: bool = True
    interface_modes: int | None = None
    retention: float = 0.0
    mistuning: Mistuning | None = None
    modes_like: tuple[float, ...] = ()
    aerodynamics: Aerodynamics | None = None

    def __post_init__(self) -> None:
        if not self.parts:
            raise input_error("part", "there is none", "Give a model at least one part.")
        check_choice("Model.amplitude_of", self.amplitude_of, get_args(AmplitudeOf))
        check_choice("Model.tangent", self.tangent, get_args(TangentAtSpeed))
        for name, contact in self.contacts.items():
            check_law_members(f"contact.{name}.law", contact.law)
        for name, one in (("aero", self.aerodynamics), ("mistuning", self.mistuning)):
            if one is None:
                continue
            if self.sectors == 1:
                raise no_wheel(name)
            if is_staged(self.joins):
                raise input_error(name, "is of one wheel, and a join couples several", "Leave one out.")
            one.require(self.sectors)
        refuse_contacts_of_dofs(self.places, self.contacts)
        for part in self.parts.values():
            if part.solid is not None and (self.speed or part.solid.heated):
                part.solid.refuse_small_rotations()

    def __repr__(self) -> str:
        """Return a description in one line."""
        named = {what: getattr(self, what) for what in ("parts", "contacts", "joins", "loads")}
        words = [f"{what} {', '.join(own)}" for what, own in named.items() if own]
        if self.sectors > 1:
            words.append(f"one of {self.sectors} sectors")
        if self.speed:
            words.append(f"{self.speed:g} rad/s")
        return f"<Model: {'; '.join(words)}>"

    def __getstate__(self) -> dict[str, Any]:
        """Pickle only the fields; everything else can be computed again."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @property
    def sectors(self) -> int:
        """Number of sectors of the wheel; 1 for a single structure."""
        return max(part.sectors for part in self.parts.values())

    @property
    def rotates(self) -> bool:
        """Whether the model depends on the speed: with meshes, rigid bodies and matrices at several speeds."""
        return any(part.body is not None or part.follows_speed for part in self.parts.values())

    @property
    def matrices_at_speed(self) -> bool:
        """Whether a part has matrices at several speeds from another program."""
        return any(part.turning is not None for part in self.parts.values())

    @property
    def heated(self) -> bool:
        """Whether thermal strain loads a part."""
        return any(part.solid is not None and part.solid.heated for part in self.parts.values())

    @property
    def loads_steadily(self) -> bool:
        """Whether rotation or thermal strain is a static load.

        Raises
        ------
        InputError
            If thermal strain is one and the centrifugal load of a rotating model is not.
        """
        turns = self.speed > 0
        if self.heated and turns and not self.centrifugal:
            raise input_error(
                "rotation.centrifugal",
                "is false, but parts have thermal strain, which loads the model together with the speed",
                "Leave it out, or take a uniform temperature without expansion.",
            )
        return self.heated or (self.centrifugal and turns)

    @property
    def _has_mesh(self) -> bool:
        return any(part.solid is not None for part in self.parts.values())

    @property
    def axis(self) -> Axis:
        """Axis of rotation of the first part that rotates."""
        every = list(self.parts.values())
        turning = [part for part in every if part.follows_speed or part.sectors > 1]
        return (turning or every)[0].axis

    @cached_property
    def places(self) -> Places:
        """Dofs and surfaces by their names in the model."""
        return Places(self.parts)

    @cached_property
    def _unjoined(self) -> Neighbours | None:
        onward = any(name.startswith(NEXT) for join in self.joins.values() for name in join.between)
        return None if is_staged(self.joins) else neighbours(self.places, self.parts, joined=onward)

    @cached_property
    def stages(self) -> Multistage | None:
        """Wheels of a model whose joins couple several by spatial harmonics; None otherwise."""
        found = stages_of(self.places, self.joins, self.contacts, self.speed * self.rotates)
        if found is not None and self.heated:
            raise input_error("temperature", "strains stages that are coupled by spatial harmonics", ALONE)
        return found

    @cached_property
    def neighbours(self) -> Neighbours | None:
        """Cyclic faces between the parts of neighbouring sectors; None for a single structure."""
        found = self._unjoined
        return None if found is None else with_joins(found, self.ties)

    @cached_property
    def ties(self) -> Ties:
        """Ties of the joins."""
        turn = None if self._unjoined is None else self._unjoined.turn
        return tie_joins(self.places, self.joins, turn)

    @cached_property
    def pairs(self) -> Pairs:
        """Contact points of all contacts."""
        refuse_joined(self.contacts, self.joins)
        here = self.neighbours
        return pair_contacts(self.places, self.contacts, None if here is None else here.turn)

    @cached_property
    def _orders(self) -> tuple[int | None, dict[str, int]]:
        return engine_order(self.loads, self.sectors > 1)

    @property
    def engine_order(self) -> int | None:
        """Engine order of the frequency: order of the loads, or greatest common divisor of several.

        None for a single structure.
        """
        return self._orders[0]

    @property
    def driven(self) -> dict[str, int]:
        """Harmonic of each load, as a multiple of the frequency of `engine_order`; 0 for static loads."""
        return self._orders[1]

    @cached_property
    def memo(self) -> dict[str, Any]:
        """Cache of derived quantities; `pickle` drops it."""
        return {}

    @property
    def spread(self) -> tuple[str, ...]:
        """Names of the loads whose nodes the reduction does not keep.

        These are pressure fields on a wheel, which are projected on its modes.
        """
        fields = [name for name, load in self.loads.items() if load.field is not None]
        return tuple(fields) if self.sectors > 1 else ()

    def without_aerodynamics(self) -> "Model":
        """Return the model without aerodynamic forces; itself if it has none."""
        return self if self.aerodynamics is None else replace(self, aerodynamics=None)

    @property
    def facts(self) -> Facts:
        """Mass, size and counts of one sector."""
        return facts_of_parts(self.parts.values())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return the warnings for the user."""
        of_parts = [text for part in self.parts.values() for text in part.warnings]
        of_wheel = () if self.neighbours is None else self.neighbours.warnings
        between = [*(c.between for c in self.contacts.values()), *(j.between for j in self.joins.values())]
        touched = [name for pair in between for name in pair]
        if self.aerodynamics is None and uncoupled(self.parts, touched):
            of_wheel = (_UNCOUPLED.format(self.sectors),)
        of_units = unlike_units(self.parts)
        of_outputs = far_outputs(self.places, self.outputs)
        of_fields = doubtful_fields(self.places, self.loads)
        of_speeds = other_speeds(self.parts, self.speed)
        orders = beyond_sectors(self.loads, self.sectors)
        of_faces = untied_faces(self.parts, touched)
        own = [*of_parts, *of_faces, *of_units, *of_speeds, *of_outputs, *of_wheel, *orders, *of_fields]
        return tuple(dict.fromkeys([*own, *self.pairs.warnings]))

    def spin(self, speed: float) -> Spin:
        """Return the rotation of the model at a speed in rad/s."""
        return Spin(float(speed), self.tangent, self.coriolis, self.axis, self.modes_like)

    def full(self, speed: float, *, with_damping: bool = False) -> Structure:
        """Return all parts at a speed in rad/s, without joins and cyclic faces; `with_damping` as in `at`."""
        spin, rest = self.spin(speed), self.steady
        own = {name: at_speed(name, part, spin, rest[name]) for name, part in self.parts.items()}
        if with_damping:
            own = {name: damped(name, self.parts[name], part) for name, part in own.items()}
        return join(**own)

    @cached_property
    def steady(self) -> dict[str, Steady]:
        """Name of a part -> conditions of its displacement in steady rotation, from cyclic faces and joins."""
        if self.joins and self._has_mesh:
            loose = self._loose(np.zeros(len(self.pairs.names), dtype=bool))
            return joined_displacements(self.places, self.coordinates, (self.neighbours, self.ties), loose)
        ties = {} if self.neighbours is None else self.neighbours.ties
        return {name: steady_of(part, ties.get(name)) for name, part in self.parts.items()}

    @cached_property
    def coordinates(self) -> Coordinates:
        """Coordinates of `full` under the ties of the joins."""
        return coordinates(np.arange(self.places.n), self.ties)

    def at(
        self,
        speed: float,
        wave_number: int = 0,
        contacts: Literal["open", "stuck"] | BoolArray = "open",
        *,
        with_damping: bool = False,
    ) -> Structure:
        """Return the full structure for small vibrations at a speed; for a sector, one travelling wave.

        Parameters
        ----------
        speed
            In rad/s.
        wave_number
            Wave number modulo the number of sectors; unused for a single structure.
        contacts
            State of the contacts. ``open``: no forces; ``stuck``: all are springs; an array (p,): these points are
            springs, as from `holding_points` for the static state. Rigid bodies without any support are then left out.
        with_damping
            Whether to include damping from the matrices of the parts; modal damping ratios are never included.

        Returns
        -------
        Structure
            Sparse if a part is sparse; `basis` maps to the dofs of all parts, in the order of `places`.
        """
        at = self.coordinates
        structure, tie = at.tied(self.full(speed, with_damping=with_damping)), at.tie
        operators = [at.columns(self.pairs.own), at.columns(self.pairs.following)]
        phase: complex | float = 1.0
        if self.neighbours is not None:
            structure = travelling_wave(self.neighbours.sector(structure, at), wave_number)
            phase = wave(wave_number, self.sectors).phase
            way = structure.basis
            operators = [operator @ way for operator in operators]
            tie = way if tie is None else tie @ way
        holds = np.full(len(self.pairs.names), contacts == "stuck") if isinstance(contacts, str) else contacts
        largest = float(np.abs(structure.stiffness.diagonal()).max())
        stiffness = np.where(np.repeat(holds, 3), held_stiffness(self.pairs.laws, holds, STIFF * largest), 0.0)
        if holds.any():
            structure = with_springs(structure, operators[0] + phase * operators[1], stiffness)
        structure = structure if tie is None else replace(structure, basis=tie)
        loose = self._loose(holds)
        return without_bodies(structure, {self.places.dofs.part[dof] for dof in loose})

    def _loose(self, holds: BoolArray) -> IntArray:
        """Return the dofs of rigid bodies that no contact or join holds."""
        rows = np.repeat(holds, 3)
        touched = [m[rows].nonzero()[1] for m in (self.pairs.own, self.pairs.following)]
        return self.places.bodies(np.concatenate([*touched, self.ties.weights.nonzero()[1]]))

    @cached_property
    def skin(self) -> Skin | None:
        """Outer surface of the meshes; None if no part has a mesh."""
        return skin_of(self.parts)

    def on_skin(self, field: Matrix) -> Matrix:
        """Return displacements (m, n, 3) of the skin's points from fields (N, m) on the dofs of all parts.

        `at(...).expand` returns such fields.
        """
        return on_skin(self.places, field)

    def static_displacement(self, speed: float) -> dict[str, FloatArray]:
        """Return the (nodes, 3) static displacements in m of the meshes that rotate at a speed in rad/s or are heated."""
        return {
            name: part.solid.at_nodes(self.steady[name].displacement(part, speed))
            for name, part in self.parts.items()
            if part.solid is not None and is_loaded(part, speed)
        }

    def static_state(self, speed: float) -> StaticState | None:
        """Return the static state of the solids under the centrifugal load at a speed in rad/s; None without such a load."""
        return static_state(self.parts, self.static_displacement(speed), speed)

    @cached_property
    def undriven(self) -> "Model":
        """The model without harmonic loads, with the same outputs."""
        driven = {name: load for name, load in self.loads.items() if load.harmonic > 0}
        still = {name: load for name, load in self.loads.items() if name not in driven}
        places = tuple(Output(name=name, on=load.on) for name, load in driven.items())
        return replace(self, loads=still, outputs=self.outputs or places)
