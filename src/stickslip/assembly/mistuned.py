"""A mistuned wheel as solvers see it: all its sectors, what they differ by, and every blade's outputs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.assembly.asked import Asked, asked, excitation
from stickslip.assembly.assembled import Assembled, Blades
from stickslip.assembly.build import (
    Linear,
    assemble,
    contact_table,
    loads_on,
    physical,
    static_state,
)
from stickslip.assembly.contact import Contact
from stickslip.assembly.deviations import deviations
from stickslip.assembly.held import held_warnings
from stickslip.assembly.mistuning import ContactMistuning
from stickslip.assembly.model import Model
from stickslip.assembly.pairs import Pairs
from stickslip.assembly.places import picked
from stickslip.assembly.points import in_points
from stickslip.assembly.reduced import Store
from stickslip.assembly.rigid import InGaps, in_gaps
from stickslip.assembly.shares import at_rest
from stickslip.assembly.statics import pressed_by
from stickslip.assembly.waves import SectorWaves, sector_waves
from stickslip.assembly.wheel import partners
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws import law_name
from stickslip.errors import input_error
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.reduction.sectors import circulant, couplings, repeated, travelling
from stickslip.reduction.waves import excited_wave, wave
from stickslip.response.system import System

KINDS = ("mass", "damping", "stiffness")
RELATIVE = {
    "friction_coefficient": ("mu",),
    "preload": ("preload",),
    "stiffness": ("k_t", "k_w", "k_n"),
}  # fields of laws


def assemble_mistuned(model: Model, harmonics: int, store: Store) -> Assembled:
    """Return a wheel with all its sectors as solvers see it; see `Model.assembled`."""
    assert model.mistuning is not None
    if model.neighbours is None:
        raise input_error(
            "mistuning",
            "is of a wheel, and no part is a sector of one",
            "Give a part its number of sectors.",
        )
    alike = replace(model, mistuning=None)
    tuned = assemble(alike, harmonics, store)
    what = asked(alike, harmonics)
    wheel = all_sectors(model, what, store)
    n, order = model.sectors, what.order
    pairs = pairs_of_all(model)
    linear = wheel.linear(order or 0)
    bodies = model.places.bodies(model.ties.weights.nonzero()[1])
    system = System(
        wheel.structure,
        Interface(pairs.names, pairs.laws, wheel.gaps),
        wheel.of_dofs(what.labels.dofs, "output.points"),
        alert_dofs=wheel.of_dofs(what.watched, "alert_over"),
        free=wheel.of_dofs(bodies, "part") if bodies.size else None,
    )
    load = loads_on(alike, linear, what.forces)
    held = system.with_retention(model.retention)
    gap, force = static_state(held, load.static)
    pressed = pressed_by(system.springs.laws, force)
    names = of_all(what.labels.names, n)
    return Assembled(
        system=held,
        bare=system,
        load=load,
        contacts=contact_table(pairs),
        output_labels=names,
        peak_output=_peak(what, model, names),
        error_labels=of_all(what.names, n),
        retention=model.retention,
        excitation=excitation(model),
        static_gap=gap,
        static_force=force,
        frequencies=tuned.frequencies,
        skin=model.skin,
        sectors=n,
        engine_order=order,
        counts={
            "nodes": model.facts.nodes,
            "dofs": model.places.n,
            "reduced": wheel.structure.n,
            "retained": int(held.retained.size),
        },
        warnings=(
            *model.warnings,
            *held_warnings(alike, np.all(pressed.reshape(n, -1), axis=0).reshape(-1)),
            *tuned.frequencies.warnings(),
        ),
        blades=Blades(n, what.labels.names, tuned),
        orders=what.orders,
    )


def of_all(names: Sequence[str], sectors: int) -> tuple[str, ...]:
    """Return the labels ``name[n].direction`` of all sectors; ``name[n]`` of a name without a direction."""
    return tuple(_of_sector(name, n) for n in range(sectors) for name in names)


def _of_sector(name: str, sector: int) -> str:
    head, dot, last = name.rpartition(".")
    return f"{head}[{sector}].{last}" if dot else f"{name}[{sector}]"


def _peak(what: Asked, model: Model, names: tuple[str, ...]) -> int:
    """Return the output whose peak is resolved: that named, of sector 0 where no sector is."""
    wanted = model.peak_output
    if not wanted:
        return 0
    if wanted in names:
        return names.index(wanted)
    what.labels.of((wanted,), "output.peak")
    return what.labels.names.index(wanted)


@dataclass(frozen=True, eq=False)
class AllSectors:
    """All sectors of a wheel, reduced.

    Parameters
    ----------
    model
        Of one of them.
    waves
        Of the tuned wheel.
    size
        Coordinates of each sector before contacts changed them: kept dofs in its own axes, then modes.
    found
        The wheel, in gaps or contact points where that leaves fewer coordinates.
    """

    model: Model
    waves: SectorWaves
    size: int
    found: InGaps

    @property
    def structure(self) -> Structure:
        """The wheel."""
        return self.found.structure

    @property
    def gaps(self) -> Matrix:
        """(3 p n_s, n) CSR, sector by sector."""
        return self.found.gaps

    def of_dofs(self, dofs: IntArray, place: str) -> IntArray:
        """Return the coordinates of dofs of the parts in all sectors, sector by sector; `place` is the key that asks."""
        own = places_of(self.model, self.waves, dofs, place)
        every = (np.arange(self.model.sectors)[:, None] * self.size + own).ravel()
        return self.found.of(every, place)

    def load(self, force: Matrix, wave_number: int) -> Matrix:
        """Return the load of all sectors of one (N,) on kept dofs of the parts, which travels as a wave."""
        sector, kept = self.waves.sector, self.waves.kept
        angle = wave(wave_number, sector.sectors).phase_angle
        on_wave = sector.wave_tie(wave_number).conj().T @ self.model.coordinates.load(force)
        own = np.zeros(self.size, dtype=on_wave.dtype)
        own[: kept.size] = on_wave[np.searchsorted(sector.independent, kept)]
        return self.found.load(travelling(own, angle, sector.sectors))

    def steady(self) -> FloatArray:
        """Return the load of steady rotation."""
        load = self.waves.waves[0][1]
        own = np.real(load if load.ndim == 1 else load[:, 0])
        return np.asarray(self.found.load(np.tile(own, self.model.sectors)))

    def linear(self, order: int) -> Linear:
        """Return the wheel as the linear side of a model under an engine order."""

        def load(force: Matrix, harmonic: int) -> Matrix:
            return self.load(force, excited_wave(order, self.model.sectors, harmonic))

        return Linear(self.structure, self.gaps, self.steady(), self.of_dofs, load, None)


def all_sectors(model: Model, what: Asked, store: Store) -> AllSectors:
    """Reduce all waves of a wheel, return to its sectors, and add what these differ by."""
    kept, _ = physical(model, what.kept)
    changes = deviations(model)
    rows = scipy.sparse.vstack([c.rows for c in changes], format="csr") if changes else None
    waves = sector_waves(model, range(model.sectors), kept, store, rows)
    every = [waves.waves[k] for k in range(model.sectors)]
    size = every[0][0].n
    matrices = {kind: circulant(couplings([getattr(s, kind) for s, _ in every])) for kind in KINDS}
    loss = None
    if every[0][0].loss is not None:
        loss = circulant(couplings([s.loss for s, _ in every]))
    first = 1
    for change in changes:
        count = change.rows.shape[0]
        seen = couplings([load[:, first : first + count].conj().T for _, load in every])
        for kind, added in change.change(seen).items():
            matrices[kind] = matrices[kind] + added
        first += count
    dofs = _dofs(waves, every[0][0].dofs)
    structure = Structure(
        matrices["mass"], matrices["damping"], matrices["stiffness"], dofs, loss=loss
    )
    gaps = gaps_of_all(model, waves, size)
    pairs = pairs_of_all(model)
    found = in_gaps(pairs, structure, gaps)
    if found.place is None:
        bodies = model.places.bodies()
        own = places_of(
            model, waves, np.unique(np.concatenate([what.stay, bodies])), "output.points"
        )
        fixed = (np.arange(model.sectors)[:, None] * size + own).ravel()
        found = in_points(structure, gaps, fixed, pairs.names)
    return AllSectors(model, waves, size, found)


def places_of(model: Model, waves: SectorWaves, dofs: IntArray, place: str) -> IntArray:
    """Return where dofs of the parts stand among the coordinates of their sector."""
    sector, at = waves.sector, model.coordinates
    own = at.of_dofs(dofs, model.places.dofs, place)
    behind = own[partners(sector)[own] != own]
    if behind.size and place == "output.points":
        raise input_error(
            place,
            f"{sector.structure.dofs.labels[int(behind[0])]} lies on the high cyclic face, which moves as the neighbour's low face",
            "Take its partner on the low face, or a place beside the faces.",
        )
    return np.searchsorted(waves.kept, partners(sector)[own])


def gaps_of_all(model: Model, waves: SectorWaves, size: int) -> Matrix:
    """Return the (3 p n_s, n_s size) CSR operator from the coordinates of all sectors to their gaps."""
    sector, at = waves.sector, model.coordinates
    own, following = (at.columns(m) for m in (model.pairs.own, model.pairs.following))
    touched = np.union1d(own.nonzero()[1], following.nonzero()[1])
    shared = np.intersect1d(touched, sector.shared)
    if shared.size:
        raise input_error(
            "contact",
            f"touches {sector.structure.dofs.labels[shared[0]]} on the axis, which all sectors share",
            "Leave that node out.",
        )
    place = np.searchsorted(sector.independent, waves.kept)
    tie = sector.tie[:, : sector.independent.size][:, place]
    high = np.zeros(sector.structure.n)
    high[sector.high] = 1.0
    tied, free = (scipy.sparse.diags_array(d) @ tie for d in (high, 1.0 - high))
    wide = picked(np.arange(place.size), size)
    known = [own @ free, own @ tied + following @ free, following @ tied]
    return repeated([m @ wide for m in known], sector.sectors)


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
    """Return the law of a contact point of which a quantity deviates; `key` is that of the deviation."""
    if one.quantity == "gap":
        spot = Contact(between=("", ""), law=law, gap=value)
        return at_rest(key, spot)
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


def _dofs(waves: SectorWaves, own: Dofs) -> Dofs:
    """Return the table of all sectors: ``part[n]``, positions turned."""
    n, k, axis = waves.sector.sectors, waves.kept.size, waves.sector.axis
    position = np.tile(own.position, (n, 1, 1))
    for i in range(1, n):
        if axis is not None:
            position[i, :k] = axis.turned(own.position[:k], i * waves.sector.pitch)
    parts = tuple(f"{part}[{i}]" for i in range(n) for part in own.part)
    return Dofs(np.tile(own.node, n), own.component * n, position.reshape(-1, 3), parts)
