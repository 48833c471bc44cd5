"""A mistuned wheel for the solvers: all sectors, their deviations, and the outputs of every blade; its modes with contacts open, stuck, or in the static state."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.assembly.assembled import Assembled, Blades
from stickslip.assembly.build import (
    Linear,
    assemble_tuned,
    contact_table,
    flow_around,
    holding_points,
    loads_on,
    physical,
    static_state,
)
from stickslip.assembly.contact import Contact
from stickslip.assembly.fluid.aero_forces import about_static_state
from stickslip.assembly.forces import output_labels
from stickslip.assembly.joints.gap_coordinates import refuse_mixed_gaps
from stickslip.assembly.joints.pairs import Pairs, at_rest
from stickslip.assembly.joints.unconstrained_bodies import held_warnings
from stickslip.assembly.locations import picked
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.part_reduction import Store, in_memory
from stickslip.assembly.response_request import Asked, asked, excitation
from stickslip.assembly.sides.deviations import Deviation, deviations
from stickslip.assembly.sides.mistuning import ContactMistuning
from stickslip.assembly.sides.waves import SectorWaves, sector_waves
from stickslip.assembly.sides.wheel import ReducedSector, wheel_of
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw, held_stiffness
from stickslip.contact.laws import law_name
from stickslip.errors import InputError, input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.rigid_contacts import STIFF
from stickslip.model.modes import normal_modes, with_springs
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.contact_coordinates import gaps_by_sector
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.mistuned import MistunedWheel, circulant, couplings, mistuned_wheel, repeated, travelling
from stickslip.reduction.tuned import TunedWheel
from stickslip.reduction.waves import excited_wave, wave
from stickslip.response.equilibrium import pressed_by
from stickslip.response.system import System

RELATIVE = {
    "friction_coefficient": ("mu",),
    "preload": ("preload",),
    "slip_limit": ("limit",),
    "stiffness": ("k_t", "k_w", "k_n"),
}  # fields of laws


def assemble_mistuned(model: Model, harmonics: int, store: Store) -> Assembled:
    """Assemble a wheel with all its sectors; see `assemble`."""
    assert model.mistuning is not None
    alike, n = replace(model, mistuning=None), model.sectors
    tuned = assemble_tuned(alike, harmonics, store)
    what = asked(alike, harmonics)
    wheel, (system, held), load = system_of_all(model, what, store)
    gap, force = static_state(held, load.static)
    pressed = pressed_by(system.springs.laws, force)
    return Assembled(
        system=held,
        bare=system,
        load=load,
        contacts=contact_table(pairs_of_all(model)),
        output_labels=of_all(what.labels.names, n),
        peak_output=0,
        error_labels=of_all(what.names, n),
        retention=model.retention,
        excitation=excitation(model),
        static_gap=gap,
        static_force=force,
        frequencies=tuned.frequencies,
        skin=model.skin,
        sectors=n,
        engine_order=what.order,
        counts={
            "nodes": model.facts.nodes,
            "dofs": model.places.n,
            "reduced": wheel.side.n,
            "retained": int(held.retained.size),
        },
        warnings=(
            *model.warnings,
            *held_warnings(alike, np.all(pressed.reshape(n, -1), axis=0).reshape(-1)),
            *tuned.frequencies.warnings(),
        ),
        blades=Blades(n, what.labels.names, tuned, model.mistuning.patterns),
        orders=what.orders,
    )


def system_of_all(model: Model, what: Asked, store: Store) -> tuple["AllSectors", tuple[System, System], HarmonicLoad]:
    """Return a wheel with all its sectors, its system without and with the retention, and the loads on it."""
    alike, wheel = replace(model, mistuning=None), all_sectors(model, what, store)
    refuse_mixed_gaps(alike, wheel.gaps[: 3 * len(alike.pairs.names)])
    pairs = pairs_of_all(model)
    bodies = model.places.bodies(model.ties.weights.nonzero()[1])
    system = System(
        wheel.side,
        Interface(pairs.names, pairs.laws, wheel.gaps),
        wheel.of_dofs(what.labels.dofs, "output.points"),
        alert_dofs=wheel.of_dofs(what.watched, "alert_over"),
        free=wheel.of_dofs(bodies, "part") if bodies.size else None,
        peak_of=_peak(what, model, of_all(what.labels.names, model.sectors)),
    )
    held = system.with_retention(model.retention)
    own = loads_on(alike, wheel.linear(what.order or 0), what.forces)
    return wheel, (system, held), about_static_state(held, own, wheel.fluid)


def of_all(names: Sequence[str], sectors: int) -> tuple[str, ...]:
    """Return the labels ``name[n].direction`` of all sectors; ``name[n]`` of a name without a direction."""
    return tuple(_of_sector(name, n) for n in range(sectors) for name in names)


def _of_sector(name: str, sector: int) -> str:
    head, dot, last = name.rpartition(".")
    return f"{head}[{sector}].{last}" if dot else f"{name}[{sector}]"


def listed(labels: Sequence[str]) -> str:
    """Return labels as text; three and more consecutive sectors become ``tip[0].x to tip[23].x``."""
    sectors: dict[tuple[str, str], list[int | None]] = {}
    for label in labels:
        head, _, rest = label.partition("[")
        number, closed, tail = rest.partition("]")
        alike = bool(closed) and number.isdecimal()
        key = (f"{head}[", f"]{tail}") if alike else (label, "")
        sectors.setdefault(key, []).append(int(number) if alike else None)
    return ", ".join(_in_a_row(*key, own) for key, own in sectors.items())


def _in_a_row(head: str, tail: str, sectors: Sequence[int | None]) -> str:
    each = [head if n is None else f"{head}{n}{tail}" for n in sectors]
    first = sectors[0]
    row = first is not None and list(sectors) == list(range(first, first + len(sectors)))
    return f"{each[0]} to {each[-1]}" if row and len(each) > 2 else ", ".join(each)


def _peak(what: Asked, model: Model, names: tuple[str, ...]) -> IntArray:
    """Return the outputs whose largest amplitude is the peak: the named one, in all sectors if no sector is named."""
    wanted = model.peak_output
    if wanted in names:
        return np.array([names.index(wanted)])
    own = what.labels.names
    if wanted:
        what.labels.of((wanted,), "output.peak")
    first = own.index(wanted) if wanted else 0
    return np.asarray(first + len(own) * np.arange(model.sectors))


@dataclass(frozen=True, eq=False)
class AllSectors:
    """Reduced wheel with all its sectors.

    Parameters
    ----------
    model
        Model of one sector.
    sector
        Tuned wheel with all its waves. All sectors have the same coordinates.
    side
        Linear part of the wheel.
    gaps
        (3 p n_s, n) CSR gaps from the coordinates, sector by sector.
    fluid
        (n, n) stiffness by which the frozen aerodynamic force changes the wheel; None without a fluid.
    """

    model: Model
    sector: ReducedSector
    side: MistunedWheel | Structure
    gaps: Matrix
    fluid: Matrix | None = None

    @property
    def size(self) -> int:
        """Number of coordinates of a sector."""
        return self.side.n // self.model.sectors

    def of_dofs(self, dofs: IntArray, place: str) -> IntArray:
        """Return the coordinates of dofs of the parts in all sectors, sector by sector; `place` is the study key."""
        at = self.model.coordinates
        own = self.sector.of_dofs(at.of_dofs(dofs, self.model.places.dofs, place), place)
        return np.asarray((np.arange(self.model.sectors)[:, None] * self.size + own).ravel())

    def expand(self, q: Matrix) -> Matrix:
        """Return the (n_s, N) motion of all dofs of each sector, in the sector's own axes, from all coordinates (n,).

        The wheel must have been reduced with the store `with_ways_back`.
        """
        n, at = self.model.sectors, self.model.coordinates
        waves = np.fft.fft(q.reshape(n, self.size), axis=0)
        every = [at.untied(self.sector.expand(own, k)) for k, own in enumerate(waves)]
        return np.asarray(np.fft.ifft(np.array(every), axis=0))

    def linear(self, order: int) -> Linear:
        """Return the wheel as the linear part of a model under an engine order."""
        n = self.model.sectors

        def load(force: Matrix, harmonic: int) -> Matrix:
            k = excited_wave(order, n, harmonic)
            own = self.sector.load(self.model.coordinates.load(force), k)
            return travelling(own, wave(k, n).phase_angle, n)

        steady = self.sector.steady
        own = steady if steady.ndim == 1 else steady[:, 0]

        def field(name: str, harmonic: int) -> Matrix:
            k = excited_wave(order, n, harmonic)
            return travelling(self.sector.field(self.model.spread.index(name), k), wave(k, n).phase_angle, n)

        return Linear(self.side, self.gaps, np.tile(own, n), self.of_dofs, load, None, field)


def all_sectors(model: Model, what: Asked, store: Store) -> AllSectors:
    """Reduce all waves of a wheel, transform them to sectors, and add the deviations of the sectors."""
    kept, _ = physical(model, what.kept)
    changes = deviations(model)
    behind = [c.behind for c in changes if c.behind is not None]
    rows = None
    if changes:
        rows = scipy.sparse.vstack([*(c.rows for c in changes), *behind], format="csr")
    waves = sector_waves(model, range(model.sectors), kept, store, rows, flow_around(model, store))
    sector, gaps = _in_sectors(model, waves, what)
    structures = [sector.wheel.waves[k] for k in range(model.sectors)]
    seen = []
    for k in range(model.sectors):
        loads = waves.waves[k][1]
        shares = loads[:, 1:].conj().T if loads.ndim > 1 else np.zeros((0, loads.size))
        phase = wave(k, model.sectors).phase
        beside = np.conj(phase) if waves.sector.ahead > 0 else phase
        seen.append(_with_behind(changes, shares, beside) @ sector.ways[k])
    few = [change.factors is not None for change in changes]
    counts = [change.rows.shape[0] for change in changes]
    factors = [c.factors for c in changes if c.factors is not None]
    mine = np.repeat(few, counts).astype(bool)
    wheel = mistuned_wheel(
        structures,
        [shares[mine] for shares in seen],
        np.hstack([np.zeros((model.sectors, 0)), *factors]),
        _dofs(waves.sector, structures[0].dofs),
    )
    forces = sector.wheel.feedback
    fluid = None
    if forces:
        fluid = circulant(couplings([forces[k].stiffness() for k in range(model.sectors)]))
    if all(few):
        return AllSectors(model, sector, wheel, gaps, fluid)
    structure = wheel.structure
    for first, count, change in zip(np.cumsum([0, *counts]), counts, changes, strict=False):
        if change.change is not None:
            blocks = couplings([shares[first : first + count] for shares in seen])
            for kind, added in change.change(blocks).items():
                structure = replace(structure, **{kind: getattr(structure, kind) + added})
    return AllSectors(model, sector, structure, gaps, fluid)


def _with_behind(changes: Sequence[Deviation], shares: Matrix, beside: complex | float) -> Matrix:
    """Return the shares of a sector's deviations in a wave, with the motion of the sector that follows it times `beside`."""
    first = np.cumsum([0, *(c.rows.shape[0] for c in changes)])
    found, next_one = shares[: first[-1]], int(first[-1])
    if next_one == shares.shape[0]:
        return found
    found = found.astype(np.result_type(shares, type(beside)))
    for start, change in zip(first, changes, strict=False):
        if change.behind is not None:
            count = change.rows.shape[0]
            found[start : start + count] += beside * shares[next_one : next_one + count]
            next_one += count
    return found


def _in_sectors(model: Model, waves: SectorWaves, what: Asked) -> tuple[ReducedSector, Matrix]:
    """Return all waves, in gap coordinates if they can be written in them, and the gaps of all sectors."""
    at, n = model.coordinates, model.sectors
    pairs = replace(model.pairs, own=at.columns(model.pairs.own), following=at.columns(model.pairs.following))
    bodies = model.places.bodies()
    shown, held = (at.of_dofs(np.unique(d), model.places.dofs, "output.points") for d in (what.stay, bodies))
    found = wheel_of(waves.sector, waves.kept, waves.waves, (0, 0), pairs, (shown, held))
    if not found.wheel.multipliers.size:
        return waves.with_forces(found), repeated([found.gaps], n)
    # a contact dof belongs to this sector and to a neighbour: the sectors of a whole wheel need no copies
    own = {k: structure for k, (structure, _) in waves.waves.items()}
    size = own[0].n
    same = scipy.sparse.eye_array(size, format="csr")
    plain = TunedWheel(own, n, 0, 0)
    steady = np.real(waves.waves[0][1])
    sector = ReducedSector(waves.sector, waves.kept, dict.fromkeys(own, same), waves.waves, plain, found.gaps, steady)
    return waves.with_forces(sector), _shifted_gaps(waves, pairs, size)


def _shifted_gaps(waves: SectorWaves, pairs: Pairs, size: int) -> Matrix:
    """Return the gaps of all sectors from their coordinates.

    Each contact acts on three sectors: this one, the next one, and the one after it or the previous one.
    """
    sector = waves.sector
    place = np.searchsorted(sector.independent, waves.kept)
    wide = picked(np.arange(place.size), size)
    known, ahead = gaps_by_sector(sector, place, (pairs.own, pairs.following))
    return repeated([m @ wide for m in known], sector.sectors, ahead.tolist())


def names_of_all(model: Model) -> tuple[str, ...]:
    """Return the names of the contact points of all sectors."""
    return tuple(f"{name}[{n}]" for n in range(model.sectors) for name in model.pairs.names)


def pairs_of_all(model: Model) -> Pairs:
    """Return the contact points of all sectors, without their operators."""
    pairs, n = model.pairs, model.sectors
    here = model.neighbours
    assert here is not None
    axis, p = here.turn.axis, len(pairs.names)
    position, frame = np.tile(pairs.position, (n, 1)), np.tile(pairs.frame, (n, 1, 1))
    if axis is not None:
        for i in range(1, n):
            rows = slice(i * p, (i + 1) * p)
            angle = 2 * np.pi * i / n
            position[rows] = axis.turned(pairs.position, angle)
            frame[rows] = axis.rotation(angle) @ pairs.frame
    empty = scipy.sparse.csr_array((3 * p * n, 0))
    return Pairs(
        empty,
        empty,
        names_of_all(model),
        pairs.groups * n,
        _laws(model),
        position,
        frame,
        np.tile(pairs.area, n),
        np.full((p * n, 3), -1),
    )


def _laws(model: Model) -> tuple[ContactLaw, ...]:
    """Return the laws of the contact points of all sectors."""
    assert model.mistuning is not None
    pairs, p = model.pairs, len(model.pairs.names)
    laws = list(pairs.laws * model.sectors)
    for name, one in model.mistuning.contacts.items():
        mine = [i for i, group in enumerate(pairs.groups) if group == one.contact]
        if not mine:
            raise input_error(
                f"mistuning.{name}.contact",
                f"is {one.contact!r}, and there is no such contact",
                f"Give one of {', '.join(dict.fromkeys(pairs.groups))}.",
            )
        for n, value in enumerate(one.values):
            for i in mine:
                laws[n * p + i] = changed(laws[n * p + i], f"mistuning.{name}", one, float(value))
    return tuple(laws)


def changed(law: ContactLaw, key: str, one: ContactMistuning, value: float) -> ContactLaw:
    """Return the law of a contact point with a deviating quantity; `key` is the study key of the deviation."""
    if one.quantity == "gap":
        spot = Contact(between=("", ""), law=law, gap=value)
        try:
            return at_rest(key, spot)
        except InputError as error:
            raise error.at(f"{key}.quantity") from None
    names = RELATIVE[one.quantity]
    has = [name for name in names if getattr(law, name, None) is not None]
    if not has:
        raise input_error(
            f"{key}.quantity",
            f"is {one.quantity}, and the law {law_name(law)} of {one.contact} has none",
            "Choose another quantity, or a law such as elastic_coulomb.",
        )
    own: Any = {name: getattr(law, name) * (1.0 + value) for name in has}
    found: ContactLaw = replace(law, **own)  # type: ignore[type-var]
    return found


def _dofs(sector: CyclicSector, own: Dofs) -> Dofs:
    """Return the table of all sectors: ``part[n]``, with rotated positions."""
    n, axis = sector.sectors, sector.axis
    position = np.tile(own.position, (n, 1, 1))
    placed = np.flatnonzero(np.isfinite(own.position).all(axis=1))
    for i in range(1, n):
        if axis is not None:
            position[i, placed] = axis.turned(own.position[placed], i * sector.pitch)
    parts = tuple(f"{part}[{i}]" for i in range(n) for part in own.part)
    return Dofs(np.tile(own.node, n), own.component * n, position.reshape(-1, 3), parts)


NO_PLACES = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class WheelModes:
    """Elastic modes of all sectors together, lowest first.

    Parameters
    ----------
    frequencies_hz
        (r,) natural frequencies, Hz.
    sector_share, wave_share
        (r, n_s) share of the kinetic energy in each sector, and in each wave number.
    """

    frequencies_hz: FloatArray
    sector_share: FloatArray
    wave_share: FloatArray


def wheel_modes(model: Model, number: int, contacts: ContactsAs = "static", store: Store = in_memory) -> WheelModes:
    """Return the lowest modes of a mistuned wheel.

    Parameters
    ----------
    model
        Model with mistuning; the fluid is neglected.
    number
        Number of modes, at most those of the reduced wheel.
    contacts
        As in `holding_points`.
    store
        As in `assemble`.
    """
    wheel, structure = _bound(model.without_aerodynamics(), contacts, store)
    massive = int(np.count_nonzero(structure.mass.diagonal()))
    found = normal_modes(structure, min(number, massive))
    strained = found.squares != 0
    return _shares(model, wheel, found.frequencies_hz[strained], np.real(found.shapes[:, strained]))


def wheel_in_flow(model: Model, number: int, contacts: ContactsAs = "static", store: Store = in_memory) -> ComplexArray:
    """Return the eigenvalues (r,), 1/s, of the lowest modes of a damped, mistuned wheel in a flow, least damped first.

    Parameters
    ----------
    model
        Model with mistuning and aerodynamics in its frozen form.
    number
        Number of modes. Their shapes are combinations of 1.5 times as many modes in still fluid.
    contacts, store
        As in `wheel_modes`.
    """
    wheel, structure = _bound(model, contacts, store)
    fluid = np.zeros((structure.n, structure.n)) if wheel.fluid is None else wheel.fluid
    still = replace(structure, stiffness=structure.stiffness + fluid)
    massive = int(np.count_nonzero(structure.mass.diagonal()))
    shapes = normal_modes(still, min(number + number // 2, massive)).shapes
    stiffness, damping = (shapes.T @ (m @ shapes) for m in (structure.stiffness, structure.damping))
    if structure.loss is not None:
        stiffness = stiffness + 1j * (shapes.T @ (structure.loss @ shapes))
    zero, one = np.zeros_like(damping), np.eye(len(damping))
    values = np.linalg.eigvals(np.block([[zero, one], [-stiffness, -damping]]))
    lowest = values[values.imag > 0]
    lowest = lowest[np.argsort(lowest.imag)][:number]
    return np.asarray(lowest[np.argsort(-lowest.real / np.abs(lowest))])


def _bound(model: Model, contacts: ContactsAs, store: Store) -> tuple[AllSectors, Structure]:
    """Return all sectors, and their matrices with springs at sticking contacts."""
    labels = output_labels(model.places, model.outputs, model.loads)
    none = Asked(None, {}, {}, labels, (), NO_PLACES)
    wheel = all_sectors(model, none, store)
    structure = wheel.side.of_harmonic(0)
    rigid = STIFF * float(np.abs(structure.stiffness.diagonal()).max())
    holds = np.tile(holding_points(model, contacts), model.sectors)
    stiffness = held_stiffness(pairs_of_all(model).laws, holds, rigid)
    if stiffness.any():
        structure = with_springs(structure, wheel.gaps, stiffness)
    return wheel, structure


def _shares(model: Model, wheel: AllSectors, hertz: FloatArray, shapes: FloatArray) -> WheelModes:
    n = model.sectors
    moved = wheel.side.of_harmonic(0).mass @ shapes
    each = (shapes * moved).reshape(n, -1, hertz.size).sum(axis=1)
    waves, driven = (np.fft.fft(rows.reshape(n, -1, hertz.size), axis=0, norm="ortho") for rows in (shapes, moved))
    by_wave = np.real(waves.conj() * driven).sum(axis=1)
    return WheelModes(hertz, (each / each.sum(axis=0)).T, (by_wave / by_wave.sum(axis=0)).T)
