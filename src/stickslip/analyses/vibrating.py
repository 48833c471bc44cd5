"""Requests that several analyses share: waves that may vibrate, modes with stuck contacts, representation of motions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stickslip.analyses.forced_response.problem import peak_first
from stickslip.arrays import FloatArray
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.assembling import assemble
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import Store
from stickslip.column import column
from stickslip.contact.compiled import Evaluator
from stickslip.errors import InputError, input_error
from stickslip.reduction.waves import NO_WAVE
from stickslip.response.equilibrium import pressed_by
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import StuckMode, stuck_modes
from stickslip.response.self_excited.problem import SAMPLES_A_HARMONIC
from stickslip.response.system import System
from stickslip.units import HZ

SAMPLES = 256


@dataclass(frozen=True, eq=False)
class Question:
    """A case of an analysis of one assembled model.

    Parameters
    ----------
    label
        Label of the case.
    model
        The assembled model; amplitudes belong to its first output. Without harmonic loads, a wheel has all its waves.
    asked
        The table of the analysis.
    evaluator
        Evaluator of the contact forces.
    facts
        Facts about the model for the result.
    """

    label: str
    model: Assembled
    asked: Any
    evaluator: Evaluator
    facts: Mapping[str, Any]

    @property
    def dof(self) -> int:
        """Coordinate of the first output."""
        return coordinate(self.model.system)

    @property
    def discretisation(self) -> Discretisation:
        """Discretisation of the motions, a nonlinear mode's with the fewest harmonics."""
        return represented(self.asked.harmonics, self.evaluator)


def represented(order: int, evaluator: Evaluator) -> Discretisation:
    """Return the discretisation of motions with harmonics up to `order`."""
    samples = max(SAMPLES, SAMPLES_A_HARMONIC * order)
    return Discretisation(order=order, samples=samples, evaluator=evaluator)


def free_to_vibrate(model: Model, harmonics: int, store: Store) -> Assembled:
    """Return a model without its harmonic loads, with the output of the peak first; a tuned wheel has all its waves."""
    still = model.undriven
    wheel = still.sectors > 1 and still.mistuning is None
    wave = 0 if wheel else None
    return peak_first(assemble(still, harmonics, store, wave_number=wave, every_wave=wheel))


def refuse_rigid(analysis: str, model: Assembled) -> None:
    """Refuse rigid contacts, whose force is no function of the gap."""
    if model.system.interface.rigid:
        raise input_error(
            analysis,
            "a contact is rigid: its force is no function of its gap",
            "Give the contacts a stiffness, such as elastic_coulomb.",
        )


def refuse_waves(analysis: str, wanted: Sequence[int] | None, model: Model) -> None:
    """Refuse wave numbers for a model that is no tuned wheel, and wave numbers that it lacks."""
    if wanted is None:
        return
    if model.sectors == 1 or model.mistuning is not None:
        raise input_error(
            f"{analysis}.wave_numbers", "are those of a tuned wheel, and the model is none", "Leave them out."
        )
    beyond = [k for k in wanted if k >= model.sectors]
    if beyond:
        raise input_error(
            f"{analysis}.wave_numbers",
            f"holds {beyond[0]}, and {model.sectors} sectors have the waves 0 to {model.sectors - 1}",
            f"A backward wave of d nodal diameters is d, a forward one {model.sectors} - d.",
        )


def no_such_mode(key: str, told: str, of: str = "the model") -> InputError:
    """Return the error for an unknown mode number."""
    return input_error(
        key,
        f"{told}, and {of} has no such mode that vibrates",
        "Modes count from 1 by frequency with contacts stuck; [modes] lists them.",
    )


def require_flow(model: Assembled, modes: Sequence[StuckMode], most: int, what: str) -> None:
    """Refuse modes outside the frequencies of the aerodynamic coefficients, up to `most` harmonics of the highest mode."""
    force = model.system.structure.feedback_of(1)
    if force is not None and force.influence.refuses and modes:
        low, high = (f(m.omega for m in modes) for f in (min, max))
        force.influence.require(low, most * high, f"{what} with up to {most} harmonics (most_harmonics)")


def as_wave(system: System, wave: int) -> System:
    """Return the system vibrating as a wave; a single structure is unchanged."""
    wheel = system.structure.wheel
    return system if wheel is None else replace(system, structure=wheel.travelling_as(wave))


def modes_of(model: Assembled, count: int, wave: int | None = None) -> list[StuckMode]:
    """Return the first modes of a wave, by default the wave of the loads, with contacts stuck if the static loads press them."""
    holds = pressed_by(model.system.springs.laws, model.static_force)
    system = model.system if wave is None else as_wave(model.system, wave)
    return stuck_modes(system, count, holds)


def mode_name(wave: int, number: int) -> str:
    """Return the name of a mode; that of a single structure has no wave."""
    return f"mode {number}" if wave == NO_WAVE else f"wave {wave}, mode {number}"


def mode_told(label: str, wave: int, mode: StuckMode) -> str:
    """Return a mode in the log: case, name, frequency and damping ratio."""
    case, name = f"{label}: " if label else "", mode_name(wave, mode.number)
    return f"{case}{name} ({mode.omega / HZ:.3f} Hz, damping ratio {100 * mode.ratio:+.4g} %)"


def known_coordinates(model: Assembled) -> dict[str, Any]:
    """Return indices and labels of the coordinates stored with free motions: retained ones including the first output, and outputs."""
    system = model.system
    retained = np.union1d(system.retained, coordinate(system))
    labels = system.structure.dofs.labels
    return {
        "retained": retained,
        "retained_label": np.array([labels[i] for i in retained]),
        "outputs": system.outputs,
        "output_label": np.array(model.output_labels),
    }


@dataclass(frozen=True, eq=False, kw_only=True)
class KeptMotions:
    """Free motions in a result; other programs can expand them to all nodes."""

    retained_label: Any = column("1", "names of the retained coordinates", along="coordinate", default=None)
    output_label: Any = column("1", "names of the outputs", along="reported", default=None)
    retained_displacement: FloatArray | None = column(
        "m",
        "its motion in each harmonic: the real and the imaginary part",
        along="cycle harmonic coordinate part",
        default=None,
    )
    output_displacement: FloatArray | None = column(
        "m", "the same of the outputs", along="cycle harmonic reported part", default=None
    )


def kept_motions(coefficients: FloatArray, known: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stored part of motions (..., harmonics, n, 2) of all coordinates: retained coordinates and outputs."""
    if not coefficients.shape[-2]:  # no motion was found
        return {}
    return {
        "retained_label": known["retained_label"],
        "output_label": known["output_label"],
        "retained_displacement": coefficients[..., known["retained"], :],
        "output_displacement": coefficients[..., known["outputs"], :],
    }


def coordinate(system: System) -> int:
    """Return the index of the coordinate whose amplitude is reported: the first output."""
    return int(np.asarray(system.outputs)[0])
