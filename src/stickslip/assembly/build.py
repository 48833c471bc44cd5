"""Assembly of a model: reduction and joining of parts, pairing of contacts, and static loads."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix, as_array
from stickslip.assembly.assembled import Assembled, ContactTable, Frequencies
from stickslip.assembly.fluid.aero_forces import Flow, about_static_state, fluid_of
from stickslip.assembly.forces import force_of
from stickslip.assembly.joints.gap_coordinates import held_gaps, in_gaps, in_points, refuse_mixed_gaps
from stickslip.assembly.joints.pairs import Pairs
from stickslip.assembly.joints.ties import Coordinates, coordinates
from stickslip.assembly.joints.unconstrained_bodies import held_warnings, refuse_pulled
from stickslip.assembly.locations import picked, stacked
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.part_reduction import Store, in_memory, reduced_parts
from stickslip.assembly.response_request import Asked, asked, centrifugal_of_bodies, excitation, static_forces
from stickslip.assembly.sides.unreduced import as_it_is, refuse_rigid
from stickslip.assembly.sides.waves import reduced_sector
from stickslip.contact.interface import Interface
from stickslip.contact.laws import law_name
from stickslip.errors import InputError, input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import LinearSide
from stickslip.model.modes import natural_frequencies, with_springs
from stickslip.model.slow_steps import step
from stickslip.model.structure import Structure, join
from stickslip.reduction.cache import content_hash
from stickslip.reduction.fixed_interface import reduce_interface
from stickslip.reduction.waves import excited_wave, wave
from stickslip.response.equilibrium import preload, pressed_by, static_contact_force
from stickslip.response.system import System

MODES = 10  # number of natural frequencies that are compared
UNKNOWN = Frequencies(*(np.zeros(0),) * 4)
INTERFACE_MODES = "reduction.interface_modes"


@dataclass(frozen=True, eq=False)
class Linear:
    """Linear part of a reduced model, without the contact forces.

    Parameters
    ----------
    side
        Structure, or the waves of a wheel.
    gaps
        (3 p, n) CSR, gaps t, w, n of p contact points from the coordinates.
    steady
        (n,) static load of steady rotation, N.
    of_dofs
        Function from dofs of all parts to coordinates. The second argument is the study key, for messages.
    load
        Function from a force on the dofs of all parts and a harmonic to the force on the coordinates.
    of_wave
        Function from a wave number to the structure with the modes of the reduced model, its gaps, and the map from
        dofs of all parts to its coordinates.
    field
        Function from the name of a load of `Model.spread` and a harmonic to the load on the coordinates; None without
        such loads.
    expand
        Function from coordinates and a harmonic to all dofs of all parts. It exists only with the store
        `with_ways_back`.
    """

    side: LinearSide
    gaps: Matrix
    steady: FloatArray
    of_dofs: Any
    load: Any
    of_wave: Any
    field: Any = None
    expand: Any = None


def assemble_tuned(
    model: Model,
    harmonics: int,
    store: Store,
    wave_number: int | None = None,
    *,
    every_wave: bool = False,
    checked: bool = True,
) -> Assembled:
    """Assemble a single structure or a tuned wheel; see `assemble`. `checked` adds the frequencies of the full model."""
    what = asked(model, harmonics)
    labels = what.labels
    order = what.order if wave_number is None else wave_number
    more = range(model.sectors) if every_wave else ()
    linear = linear_side(model, order or 0, harmonics, what.kept, what.stay, store, more)
    system, held, load = system_of(model, linear, what)
    with step(f"static equilibrium of {len(model.pairs.names)} contact points, {held.retained.size} unknowns"):
        gap, force = static_state(held, load.static)
    pressed = pressed_by(system.springs.laws, force)
    stiffness = system.springs.stuck_stiffness()
    compared = frequencies(model, linear, stiffness, order, store) if checked else UNKNOWN
    if model.peak_output:
        labels.of((model.peak_output,), "output.peak")
    peak = labels.names.index(model.peak_output) if model.peak_output else 0
    return Assembled(
        system=held,
        bare=system,
        load=load,
        contacts=contact_table(model.pairs),
        output_labels=labels.names,
        peak_output=peak,
        error_labels=what.names,
        retention=model.retention,
        excitation=excitation(model),
        static_gap=gap,
        static_force=force,
        frequencies=compared,
        skin=model.skin,
        sectors=model.sectors,
        engine_order=order,
        counts={
            "nodes": model.facts.nodes,
            "dofs": model.places.n,
            "reduced": linear.side.n,
            "retained": int(held.retained.size),
        },
        warnings=(*model.warnings, *held_warnings(model, pressed), *compared.warnings()),
        orders=what.orders,
    )


def system_of(model: Model, linear: Linear, what: Asked) -> tuple[System, System, HarmonicLoad]:
    """Return the system without and with the retention, and the loads on it."""
    refuse_mixed_gaps(model, linear.gaps)
    refuse_rigid(model, linear.side)
    system = System(
        linear.side,
        Interface(model.pairs.names, model.pairs.laws, linear.gaps),
        linear.of_dofs(what.labels.dofs, "output.points"),
        alert_dofs=linear.of_dofs(what.watched, "alert_over"),
        free=free_coordinates(model, linear),
    )
    held = system.with_retention(model.retention)
    load = about_static_state(held, loads_on(model, linear, what.forces), fluid_of(linear.side))
    return system, held, load


def linear_side(
    model: Model, order: int, harmonics: int, kept: IntArray, stay: IntArray, store: Store, more: Sequence[int] = ()
) -> Linear:
    """Reduce a model.

    Parameters
    ----------
    model
        The model.
    order, harmonics
        Engine order (unused for a single structure) and highest harmonic.
    kept
        Dofs of all parts that stay physical, in addition to those of contacts and joins.
    stay
        Dofs of outputs, each of which must be a coordinate.
    store
        As in `assemble`.
    more
        Wave numbers that are reduced in addition to those of the harmonics.
    """
    kept, needed = physical(model, kept)
    bodies = model.places.bodies()
    if model.neighbours is None:
        return _of_one(model, (kept, needed, np.concatenate([stay, bodies])), store)
    if model.interface_modes is not None:
        raise input_error(
            INTERFACE_MODES, "is for single structures: waves hold no joined nodes", "Leave it out on a wheel."
        )
    flow = flow_around(model, store)
    found = reduced_sector(model, (order, harmonics), kept, (stay, bodies), store, more, flow)
    at = model.coordinates

    def of_dofs(dofs: IntArray, place: str) -> IntArray:
        return found.of_dofs(at.of_dofs(dofs, model.places.dofs, place), place)

    def load(force: Matrix, harmonic: int) -> Matrix:
        number = excited_wave(order, model.sectors, harmonic)
        return found.load(at.load(force), number)

    def of_wave(number: int) -> tuple[Structure, Matrix, Any]:
        own, following = (at.columns(m) for m in (model.pairs.own, model.pairs.following))
        phase = wave(number, model.sectors).phase
        gaps = found.on_wave(own + phase * following, number)

        def place(dofs: IntArray) -> IntArray:
            rows = at.columns(picked(dofs, model.places.n))
            return np.asarray(found.on_wave(rows, number).indices, dtype=np.int64)

        return found.waves[number][0], gaps, place

    def field(name: str, harmonic: int) -> Matrix:
        number = excited_wave(order, model.sectors, harmonic)
        return found.field(model.spread.index(name), number)

    def expand(q: Matrix, harmonic: int) -> Matrix:
        return at.untied(found.expand(q, excited_wave(order, model.sectors, harmonic)))

    return Linear(found.wheel, found.gaps, found.steady, of_dofs, load, of_wave, field, expand)


def flow_around(model: Model, store: Store = in_memory, speed: float | None = None) -> Flow | None:
    """Return the aerodynamic force on a model at its speed, or at another `speed` in rad/s; None without coefficients.

    Raises
    ------
    InputError
        If the coefficients belong to other speeds.
    """
    given = model.aerodynamics
    if given is None:
        return None
    own = model.speed if speed is None else speed
    holds = holding_points(model, given.contacts)
    return Flow(model, own, given.influence.at_speed(own), holds, store)


def physical(model: Model, kept: IntArray) -> tuple[IntArray, IntArray]:
    """Return all dofs that stay physical, `kept` included, and those of them that interface modes do not replace."""
    pairs, ties = model.pairs, model.ties
    used = [operator.nonzero()[1] for operator in (pairs.own, pairs.following, ties.weights)]
    needed = np.unique(np.concatenate([kept, *used[:2], model.places.bodies()]))
    return np.unique(np.concatenate([needed, ties.followers, used[2]])), needed


def _of_one(model: Model, dofs: tuple[IntArray, IntArray, IntArray], store: Store) -> Linear:
    """Reduce a single structure.

    `dofs` are the kept ones, those that interface modes must not replace, and those that must stay coordinates.
    """
    kept, needed, stay = dofs
    mine = {name: kept[np.isin(kept, model.places.own(name))] - model.places.offset(name) for name in model.parts}
    parts = reduced_parts(model.parts, mine, model.spin(model.speed), model.steady, store)
    ids = []
    for name, part in parts.items():
        modal = np.full(part.structure.n - part.kept.size, -1)
        ids.append(np.concatenate([part.kept + model.places.offset(name), modal]))
    at = coordinates(np.concatenate(ids), model.ties)
    structure = at.tied(join(**{name: part.structure for name, part in parts.items()}))
    steady = at.load(np.concatenate([part.steady for part in parts.values()]))
    few = _on_shapes(model, structure, at, needed)
    gaps = few.columns(at.columns(model.pairs.own))
    found = in_gaps(model.pairs, few.structure, gaps)
    if found.place is None:
        fixed = np.unique(at.columns(picked(stay, model.places.n)).nonzero()[1])
        found = in_points(few.structure, gaps, few.place[fixed], model.pairs.names)
    structure, gaps = found.structure, found.gaps

    def of_dofs(dofs: IntArray, place: str) -> IntArray:
        return found.of(few.place[at.of_dofs(dofs, model.places.dofs, place)], place)

    def load(force: Matrix, _harmonic: int) -> Matrix:
        return found.load(few.load(at.load_of_dofs(force)))

    def of_wave(_number: int) -> tuple[Structure, Matrix, Any]:
        return structure, gaps, lambda dofs: of_dofs(dofs, "part")

    def expand(q: Matrix, _harmonic: int) -> Matrix:
        own = q if found.place is None else structure.expand(q)
        own = at.untied(own if few.way is None else few.way @ own)
        sizes = np.cumsum([part.structure.n for part in parts.values()])[:-1]
        each = zip(parts.values(), np.split(own, sizes), strict=True)
        return np.concatenate([part.structure.expand(piece) for part, piece in each])

    steady = found.load(few.load(steady))
    return Linear(as_it_is(structure, gaps), gaps, steady, of_dofs, load, of_wave, expand=expand)


def free_coordinates(model: Model, linear: Linear) -> IntArray | None:
    """Return the coordinates of rigid bodies without a join; None without such bodies."""
    dofs = _free_dofs(model)
    return linear.of_dofs(dofs, "part") if dofs.size else None


def _free_dofs(model: Model) -> IntArray:
    return model.places.bodies(model.ties.weights.nonzero()[1])


def loads_on(model: Model, linear: Linear, forces: Mapping[str, Matrix]) -> HarmonicLoad:
    """Return the load on the coordinates: static forces, including steady rotation, and harmonics."""
    static = np.zeros(linear.side.n)
    if model.loads_steadily:
        static = static + linear.steady + np.real(linear.load(centrifugal_of_bodies(model), 0))
    harmonics: dict[int, Matrix] = {}
    for name, force in forces.items():
        h = model.driven[name]
        own = linear.field(name, h) if name in model.spread else linear.load(force, h)
        if h == 0:
            static = static + np.real(own)
        else:
            harmonics[h] = harmonics.get(h, 0) + own
    return HarmonicLoad(static, harmonics)


def _first(model: Model) -> int:
    """Return the lowest harmonic that a load drives; 1 without such a load."""
    return min((h for h in model.driven.values() if h), default=1)


def static_state(system: System, static_load: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (p, 3) gaps (m) and contact forces (N) under a static load."""
    if not system.retained.size:
        raise input_error("contact", "touches no coordinate that can move", "Name surfaces that are not clamped.")
    moved = preload(system, static_load)
    gap = (system.interface.gap_operator[:, system.retained] @ moved).reshape(-1, 3)
    return gap, static_contact_force(system.springs, gap)


def holding_points(model: Model, contacts: ContactsAs) -> BoolArray:
    """Return whether contact points (p,) stick in small vibrations.

    ``stuck``: all; ``open``: none; ``static``: those pressed at rest.
    """
    p = len(model.pairs.names)
    if contacts != "static" or not p:
        return np.full(p, contacts == "stuck")
    if "pressed" not in model.memo:
        model.memo["pressed"] = _pressed(model.without_aerodynamics())
    return np.asarray(model.memo["pressed"])


def _pressed(model: Model) -> BoolArray:
    """Return whether contact points are pressed by the static loads at the model's own speed, or cannot open."""
    static = {name: load for name, load in model.loads.items() if load.harmonic == 0}
    forces = {name: force_of(model.places, name, load) for name, load in static.items()}
    refuse_pulled(model, static_forces(model, forces))
    kept = stacked(np.flatnonzero(f) for name, f in forces.items() if name not in model.spread)
    empty = kept[:0]
    linear = linear_side(model, 0, 0, kept, empty, in_memory)
    interface = Interface(model.pairs.names, model.pairs.laws, linear.gaps)
    system = System(linear.side, interface, empty, free=free_coordinates(model, linear))
    load = loads_on(model, linear, forces)
    _, force = static_state(system.with_retention(model.retention), load.static)
    return pressed_by(system.springs.laws, force)


def frequencies(model: Model, linear: Linear, springs: FloatArray, order: int | None, store: Store) -> Frequencies:
    """Compare natural frequencies of the full and the reduced model, with open and with stuck contacts.

    On a wheel this is done for the first driven harmonic.
    """
    number = 0 if order is None else excited_wave(order, model.sectors, _first(model))
    reduced, gaps, place = linear.of_wave(number)
    bodies = _free_dofs(model)
    free = _without(reduced, place(bodies)) if bodies.size else reduced
    stuck = with_springs(reduced, gaps, springs)
    moving = [int(np.count_nonzero(s.mass.diagonal())) for s in (free, stuck)]
    count = min(MODES, moving[0], max(moving[1] - held_gaps(model, gaps), 1))
    touching = bool(model.pairs.names)
    hows: tuple[Literal["open", "stuck"], ...] = ("open", "stuck") if touching else ("open",)
    full = [partial(model.at, model.speed, number, how) for how in hows]
    found = []
    for how, at in zip(hows, full, strict=True):
        state = f", contacts {how}" * touching
        with step(f"{count} natural frequencies of the full model{state}, {model.places.n} dofs", model.places.n):
            found.append(_lowest(model, at(), count, store))
    return Frequencies(found[0], natural_frequencies(free, count), found[-1], natural_frequencies(stuck, count))


def _without(structure: Structure, dofs: IntArray) -> Structure:
    stays = np.setdiff1d(np.arange(structure.n), dofs)
    square = np.ix_(stays, stays)

    def rest(matrix: Matrix) -> Matrix:
        return as_array(matrix)[square]

    own = rest(structure.mass), rest(structure.damping), rest(structure.stiffness)
    return Structure(*own, structure.dofs.take(stays))


def _lowest(model: Model, structure: Structure, count: int, store: Store) -> FloatArray:
    """Return natural frequencies of the full model; they are cached by its content."""
    content = content_hash("frequencies", structure.mass, structure.stiffness, count)
    memo = next(iter(model.parts.values())).memo
    if content not in memo:
        memo[content] = store(content, lambda: {"hz": natural_frequencies(structure, count)})["hz"]
    return np.asarray(memo[content])


def contact_table(pairs: Pairs) -> ContactTable:
    """Return the table of the contact points for results."""
    laws = tuple(law_name(law) for law in pairs.laws)
    return ContactTable(pairs.names, pairs.groups, laws, pairs.position, pairs.frame, pairs.area)


@dataclass(frozen=True, eq=False)
class OnShapes:
    """Joined structure whose joined surfaces may be reduced to a few shapes.

    Parameters
    ----------
    structure
        The structure, without `basis`.
    way
        (n0, n) CSR from the new to the previous coordinates; None: they are the same.
    place
        (n0,) new position of each previous coordinate; -1 if shapes replace it.
    """

    structure: Structure
    way: Matrix | None
    place: IntArray

    def columns(self, operator: Matrix) -> Matrix:
        """Return an operator (m, n0) on the previous coordinates as one (m, n) on the new ones."""
        return operator if self.way is None else scipy.sparse.csr_array(operator @ self.way)

    def load(self, force: Matrix) -> Matrix:
        """Return a load (n0,) on the previous coordinates as one (n,) on the new ones."""
        return force if self.way is None else np.asarray(self.way.T @ force)


def _on_shapes(model: Model, structure: Structure, at: Coordinates, needed: IntArray) -> OnShapes:
    """Reduce joined surfaces to characteristic shapes, if the model has `interface_modes`.

    Parameters
    ----------
    model
        The model; `Model.interface_modes` is the number of shapes.
    structure
        All parts, reduced and joined.
    at
        Coordinates of the structure.
    needed
        Dofs of all parts that must stay coordinates, because contacts, loads, outputs or bodies use them.

    Raises
    ------
    InputError
        If no joined dofs are left to reduce.
    """
    same = OnShapes(structure, None, np.arange(structure.n))
    if model.interface_modes is None:
        return same
    own = at.ids[at.stays]
    joined = np.isin(own, np.union1d(model.ties.followers, model.ties.weights.nonzero()[1]))
    joined[np.unique(at.columns(picked(needed, model.places.n)).nonzero()[1])] = False
    interface = np.flatnonzero(joined)
    if not interface.size:
        raise input_error(
            INTERFACE_MODES,
            f"is {model.interface_modes}, and no joined node is free for it: contacts, loads and outputs stay physical",
            "Leave it out, or join surfaces beside them.",
        )
    try:
        few = reduce_interface(structure, interface, min(model.interface_modes, interface.size))
    except InputError as error:
        raise error.inside(INTERFACE_MODES) from None
    others = np.setdiff1d(np.arange(structure.n), interface)
    place = np.full(structure.n, -1)
    place[others] = np.arange(others.size)
    return OnShapes(replace(few, basis=None), scipy.sparse.csr_array(few.basis), place)
