"""A mistuned response beside the tuned one: amplification and its bound, largest blade, waves, localisation."""

from dataclasses import replace

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.columns import Blades, stored
from stickslip.analyses.forced_response.records.values import Values
from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.response.forced.collected import Response, collect
from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.study.store.progress import LOG
from stickslip.units import HZ

BOUND = "Whitehead's (1 + √n)/2, a bound for one family of modes, equal damping of all waves and no friction only,"


def whitehead(blades: int) -> float:
    """Return Whitehead's (1 + √n)/2: largest amplification of one family of modes with equal damping in all waves, without friction."""
    return 0.5 * (1.0 + float(np.sqrt(blades)))


def localisation(amplitudes: FloatArray) -> float:
    """Return the localisation factor of amplitudes (n,): 0 if all are equal, 1 if a single blade moves."""
    largest = float(np.max(amplitudes))
    others = np.delete(amplitudes, int(np.argmax(amplitudes)))
    if not largest or not others.size:
        return 0.0
    return float(1.0 - np.sqrt(np.mean(others**2)) / largest)


def tuned_response(question: Question) -> Response:
    """Solve the same wheel with equal sectors."""
    blades = question.model.blades
    assert blades is not None
    tuned = blades.tuned
    own = int(question.model.peak_of[0]) % len(blades.labels)
    system = replace(tuned.system, outputs=np.roll(tuned.system.outputs, -own))
    sweep = question.sweep
    points = list(forced_response(system, tuned.load, sweep))
    return collect(forced_problem(system, tuned.load, sweep), points, 0)


def of_blades(question: Question, response: Response) -> Values:
    """Return the variables of a mistuned wheel; this solves the tuned wheel."""
    blades = question.model.blades
    assert blades is not None
    where = blades.same_in_all(int(question.model.peak_of[0]))
    tuned = tuned_response(question)
    count = len(question.model.output_labels)
    every = np.array([a.amplitudes(count)[where] for a in response.accepted])
    hertz = np.array([a.point.omega / HZ for a in response.accepted])
    known = np.nan_to_num(every, nan=-1.0)
    at = np.argmax(known, axis=0)
    own = every[at, np.arange(where.size)]
    motion = _motion(response, where)
    sizes = np.linalg.norm(motion, axis=0)
    factor, largest = response.peak_amplitude / tuned.peak_amplitude, int(np.argmax(own)) if where.size else -1
    of_waves = np.abs(np.fft.fft(motion, axis=1) / where.size)
    LOG.info(question.said(sentence(where.size, factor, largest)))
    found = Blades(
        blade_peak_amplitude=own,
        blade_peak_hz=hertz[at],
        blade_motion=np.stack([motion[0].real, motion[0].imag], axis=-1),
        wave_amplitude=np.linalg.norm(of_waves, axis=0),
        largest_blade=largest,
        tuned_peak_amplitude=tuned.peak_amplitude,
        tuned_peak_hz=tuned.peak_hz,
        amplification=factor,
        whitehead=whitehead(where.size),
        localisation=localisation(sizes),
        tuned_frequency_hz=np.array([a.point.omega / HZ for a in tuned.accepted]),
        tuned_amplitude=np.array([a.amplitudes(1)[0] for a in tuned.accepted]),
        deviation=np.array([*blades.deviations.values()]).reshape(-1, where.size).T,
    )
    return stored(found) | {"mistuned": tuple(blades.deviations)}


def sentence(blades: int, factor: float, largest: int) -> str:
    """State the amplification and its reference values."""
    bound = whitehead(blades)
    return f"largest blade {largest}, amplification {factor:.4g} over the wheel with all sectors alike; {BOUND} is {bound:.3g}"


def _motion(response: Response, where: IntArray) -> ComplexArray:
    """Return the (driven, blades) amplitudes at the peak."""
    top = response.top
    driven = list(response.accepted[0].driven) if response.accepted else [1]
    if top is None or top.fields is None:
        return np.full((len(driven), len(where)), np.nan, dtype=complex)
    return np.asarray(top.fields.outputs[driven][:, where])
