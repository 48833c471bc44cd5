"""Modes of a mistuned wheel with contacts open, stuck, or in the static state."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.assembly.build import holding_points
from stickslip.assembly.forces import output_labels
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.part_reduction import Store, in_memory
from stickslip.assembly.response_request import Asked
from stickslip.assembly.sides.mistuned import AllSectors, all_sectors, pairs_of_all
from stickslip.contact.law import held_stiffness
from stickslip.harmonic.rigid_contacts import STIFF
from stickslip.model.modes import normal_modes, with_springs
from stickslip.model.structure import Structure

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
