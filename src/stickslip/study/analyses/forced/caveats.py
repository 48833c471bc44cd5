"""What the user should know of a response: sentences, told while it is computed and with its result."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from stickslip.response.free_motion import drift
from stickslip.study.analyses.forced.points import Response
from stickslip.study.analyses.forced.question import Question
from stickslip.units import HZ

ROTATIONS = ("rx", "ry", "rz")
COULOMB = (
    "elastic_coulomb",
    "coupled_coulomb",
    "regularised_coulomb",
)  # friction under the normal force
LARGE_SHIFT = 0.01  # relative change of the peak worth a warning
LARGE_DIFFERENCE = 1.0  # percent between time integration and balance (Gastaldi and Berruti 2017: below it at H = 5)
RIGID = 5e-3  # Hz that are printed as zero
STUCK = 1e-18  # m/N: no structure is so stiff; what moves less sticks to rigid contacts or is held
LISTED = 5  # natural frequencies that a line names


def caveats(question: Question, response: Response, shift: tuple[float, float]) -> list[str]:
    """Return the sentences on a response, without the case's label.

    Parameters
    ----------
    question, response
        The case.
    shift
        What `peak_shift` found.
    """
    return [
        *question.model.warnings,
        *mixed_places(question.model.error_labels),
        *nothing_pressed(question),
        *_of_points(question, response),
        *_of_shape(question, response),
        *_of_drift(question, response),
        *_of_peak(question, response, shift),
    ]


def of_numbers(values: Mapping[str, Any]) -> Iterator[str]:
    """Yield what follows from the values of a case: a peak that hangs on the retention, a check that failed."""
    shift = float(np.nan_to_num(values.get("retention_peak_shift", 0.0)))
    if abs(shift) > LARGE_SHIFT:
        yield (
            f"the peak changes by {100 * shift:.3g} % when the retention stiffness of rigid bodies is ten times smaller: it depends "
            "on a stiffness that is not physical."
        )
    off = np.abs(
        np.nan_to_num(np.asarray(values.get("verify_difference_percent", ()), dtype=float))
    )
    large = int(np.count_nonzero(off > LARGE_DIFFERENCE))
    if large:
        yield (
            f"time integration and harmonic balance differ by more than {LARGE_DIFFERENCE:g} % at {large} of {off.size} frequencies; "
            "see the table of checks."
        )
    if np.any(np.asarray(values.get("verify_settled", ())) == 0):
        yield "a time integration did not settle to a periodic motion; see the table of checks."


def mixed_places(labels: Sequence[str]) -> list[str]:
    """Return a warning where an error is taken over rotations and displacements together."""
    rotations = [label for label in labels if label.rpartition(".")[2] in ROTATIONS]
    others = [label for label in labels if label not in rotations]
    if not rotations or not others:
        return []
    text = (
        f"harmonics.alert_over mixes rotations ({', '.join(rotations)}) with displacements ({', '.join(others)}): dofs that move "
        "less than a thousandth of the largest are left out, and here radians are held against metres. Name one kind only."
    )
    return [text]


def inside(question: Question) -> list[str]:
    """Return the natural frequencies beside the range of the sweep, and the normal forces at rest."""
    lowest, highest = (omega / HZ for omega in question.sweep.omega_range)
    known, normal = question.model.frequencies, -question.model.static_force[:, 2]
    told = [f"sweep: {lowest:.2f} to {highest:.2f} Hz"]
    for state, hertz in (("open", known.free_reduced), ("stuck", known.stuck_reduced)):
        rigid = int(np.count_nonzero(hertz < RIGID))
        near = [f"{f:.2f}" for f in hertz[rigid:] if f <= highest][-LISTED:]
        near = [f"{rigid} of rigid motions"] * bool(rigid) + near
        beyond = [f"{f:.2f}" for f in hertz if f > highest][:1]
        told += [f"natural frequencies, contacts {state}: {', '.join([*near, *beyond])} Hz"] * bool(near or beyond)  # fmt: skip
    if np.any(normal):
        pressed = np.count_nonzero(normal > 0)
        told.append(
            f"static equilibrium: {pressed} of {normal.size} contact points are pressed, normal forces up to {normal.max():.3g} N"
        )
    return told


def nothing_pressed(question: Question) -> list[str]:
    """Return a warning where friction under a normal force finds none in the static state."""
    laws, normal = question.model.contacts.laws, -question.model.static_force[:, 2]
    rubs = np.array([law in COULOMB for law in laws], dtype=bool)
    if not rubs.any() or np.any(normal[rubs] > 0):
        return []
    text = (
        f"all {np.count_nonzero(rubs)} contact points with friction are open in the static state: they act only where the vibration "
        "closes them. Check gaps, preloads, static loads and the direction in which the speed moves the surfaces."
    )
    return [text]


def no_resonance(question: Question) -> list[str]:
    """Return a warning where no natural frequency, contacts open or stuck, lies in the range of the sweep."""
    lowest, highest = (omega / HZ for omega in question.sweep.omega_range)
    known = question.model.frequencies
    every = np.concatenate([known.free_reduced, known.stuck_reduced])
    if not every.size or np.any((every >= lowest) & (every <= highest)):
        return []
    near = float(every[np.argmin(np.maximum(lowest - every, every - highest))])
    text = (
        f"no natural frequency lies between {lowest:.2f} and {highest:.2f} Hz, neither with open nor with stuck contacts; the "
        f"nearest one is {near:.2f} Hz. Widen forced_response.{question.key}."
    )
    return [text]


def _of_points(question: Question, response: Response) -> Iterator[str]:
    if response.failed:
        yield (
            f"{response.failed} points did not converge; the peak is the largest of the others, and a larger one may stand "
            "among them"
        )
    # between given frequencies any growth is possible: only steps of a branch are short enough to tell a jump
    on_a_grid = question.sweep.single or question.sweep.grid.size > 0
    if response.jumps_hz and not on_a_grid:
        places = ", ".join(f"{f:.2f}" for f in response.jumps_hz)
        yield (
            f"the response jumps at {places} Hz, where solutions with few and with many harmonics meet: more than one periodic "
            "motion exists near there, and which one a machine takes depends on its history."
        )


def _of_shape(question: Question, response: Response) -> Iterator[str]:
    folded = response.folded_hz(int(question.sweep.forward))
    if folded is not None:
        yield (
            f"the response folds between {folded[0]:.2f} and {folded[1]:.2f} Hz: more than one periodic motion was found there, "
            "as a rule one of them unstable. Points outside the asked range belong to the fold."
        )


def _of_drift(question: Question, response: Response) -> Iterator[str]:
    """Warn where friction leaves the mean position of a body free."""
    chosen = [a.point for a in response.accepted if not a.point.converged]
    if response.top is not None:
        chosen = [response.top.point, *chosen]
    for point in chosen:
        found = drift(question.problem, point)
        if found.undetermined:
            yield (
                f"{point.omega / HZ:.2f} Hz: every contact slips or opens in each cycle, the mean position of {found.coordinate} "
                "is undetermined and the body may drift. Give [retention] a small stiffness_n_per_m (1e-6 of the contact "
                "stiffness); the result then says how far it moves the peak."
            )
            return


def _of_peak(question: Question, response: Response, shift: tuple[float, float]) -> Iterator[str]:
    model = question.model
    if response.top is not None and response.peak_amplitude < STUCK * model.excitation:
        yield (
            f"the output {model.output_labels[model.peak_output]} does not move: a rigid contact holds it at all frequencies. "
            "Name an output that moves, or raise the load until it slips."
        )
    elif response.peak_at_end:
        yield (
            f"the largest amplitude stands at the end of the sweep ({response.peak_hz:.2f} Hz); it is no resonance. "
            f"Widen forced_response.{question.key}."
        )
    if question.model.retention > 0.0 and response.top is not None and math.isnan(shift[0]):
        yield (
            "no periodic motion was found at the peak with a tenth of the retention stiffness; the peak rests on the body being "
            "held, so do not rely on it"
        )
