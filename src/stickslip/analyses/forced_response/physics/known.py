"""Verdicts that need the model; the job stores them. Also the warnings of ``stickslip check``."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from stickslip.analyses.forced_response.problem import STILL_HZ, Question
from stickslip.contact.law import ContactLaw
from stickslip.contact.law_check import law_fault
from stickslip.contact.laws import is_of_a_user
from stickslip.model.structure import ROTATIONS
from stickslip.response.forced.choices import RelativeTo
from stickslip.response.forced.collected import Response
from stickslip.response.free_motion import drift
from stickslip.study.verdict import Verdict, doubt
from stickslip.units import HZ, RPM

COULOMB = ("elastic_coulomb", "coupled_coulomb", "regularised_coulomb")  # friction under the normal force
ASIDE = 0.04  # of a frequency, that a proposed range leaves beside it
MOVED = 1.25  # largest ratio of stuck and open frequencies that are taken for one mode
LISTED = 5  # natural frequencies that a line names


def known(question: Question, response: Response, shift: tuple[float, float]) -> tuple[Verdict, ...]:
    """Return the verdicts on a whole case that need the model, without the label of the case.

    Parameters
    ----------
    question, response
        The case and its response.
    shift
        Return value of `peak_shift`.
    """
    return (
        *(doubt(text) for text in doubts_of_model(question)),
        *mixed_places(question.model.error_labels, question.sweep.relative_to),
        *nothing_pressed(question),
        *off_engine_order(question),
        *laws_of_ones_own(question, response),
        *_of_drift(question, response),
        *_of_retention(question, response, shift),
    )


def doubts_of_model(question: Question) -> list[str]:
    """Return the warnings of the assembled model, without modes above the load's highest frequency."""
    known = question.model.frequencies
    reach = question.driven[-1] * max(question.sweep.omega_range) / HZ
    others = set(known.warnings())
    return [t for t in question.model.warnings if t not in others] + known.warnings(reach)


def mixed_places(labels: Sequence[str], relative_to: RelativeTo) -> tuple[Verdict, ...]:
    """Doubt an error norm that holds rotations against displacements; that of the answer has a largest output for each unit."""
    if relative_to == "answer":
        return ()
    rotations = [label for label in labels if label.rpartition(".")[2] in ROTATIONS]
    others = [label for label in labels if label not in rotations]
    if not rotations or not others:
        return ()
    why = (
        f"harmonics.alert_over mixes rotations ({', '.join(rotations)}) with displacements ({', '.join(others)}): dofs that move "
        "less than a thousandth of the largest are left out, and here radians are held against metres"
    )
    return (Verdict("doubtful", why=why, remedy="Name one kind only."),)


def nothing_pressed(question: Question) -> tuple[Verdict, ...]:
    """Doubt a model whose friction contacts carry no normal force in the static state."""
    laws, normal = question.model.contacts.laws, -question.model.static_force[:, 2]
    rubs = np.array([law in COULOMB for law in laws], dtype=bool)
    if not rubs.any() or np.any(normal[rubs] > 0):
        return ()
    why = (
        f"all {np.count_nonzero(rubs)} contact points with friction are open in the static state: they act only where the vibration "
        "closes them"
    )
    remedy = "Check gaps, preloads, static loads and the direction in which the speed moves the surfaces."
    return (Verdict("doubtful", why=why, remedy=remedy),)


def laws_of_ones_own(question: Question, response: Response) -> Iterator[Verdict]:
    """Doubt a law of one's own whose derivatives or stuck stiffness are wrong, tried with the motion at the peak."""
    top = response.top
    if top is None or top.fields is None:
        return
    laws = question.model.system.interface.laws
    sizes = np.abs(top.fields.gaps[1:]).max(axis=(0, 2), initial=0.0)
    largest: dict[int, tuple[ContactLaw, float]] = {}  # a law may have no hash
    for law, size in zip(laws, map(float, sizes), strict=True):
        if is_of_a_user(law) and size > largest.get(id(law), (law, 0.0))[1]:
            largest[id(law)] = law, size
    for law, size in largest.values():
        fault = law_fault(law, size, top.point.omega * size)
        if fault:
            remedy = "Correct the law; stickslip.contact.check_law tries it. A wrong derivative costs Newton steps, and what the contact stiffness changes is then wrong."
            yield Verdict("doubtful", why=f"the law {type(law).__name__} is inconsistent: {fault}", remedy=remedy)
            return


def off_engine_order(question: Question) -> tuple[Verdict, ...]:
    """Note an engine order whose frequency at the speed of rotation lies outside the sweep."""
    rpm, order = question.rpm, question.model.engine_order
    if question.over_speed or not order or not rpm:
        return ()
    lowest, highest = (omega / HZ for omega in question.sweep.omega_range)
    own = order * rpm * RPM / HZ
    if lowest <= own <= highest:
        return ()
    names = " and ".join(question.driven_names)
    harmonics = question.driven
    excited = " and ".join(f"{h * own:.6g}" for h in harmonics)
    ranges = " and ".join(f"{h * lowest:.6g} to {h * highest:.6g} Hz" for h in harmonics)
    speeds = " to ".join(f"{f * HZ / RPM / order:.0f}" for f in (lowest, highest))
    why = (
        f"at {rpm:.6g} rpm {names} excite{'s' * (len(harmonics) == 1)} at {excited} Hz, outside {ranges}; the response shows the "
        f"wheel at {rpm:.6g} rpm shaken at another frequency"
    )
    remedy = (
        f'over = "speed" goes along the engine order\'s line, which passes this range at {speeds} rpm; give rotation.speed_rpm the '
        "speed where [campbell] finds them crossing."
    )
    return (Verdict("trusted", why=why, remedy=remedy),)


def no_resonance(question: Question) -> tuple[Verdict, ...]:
    """Doubt a sweep without any natural frequency, with contacts open or stuck."""
    if len(question.driven) > 1:  # natural frequencies are known for one harmonic
        return ()
    (lowest, highest), every = question.driven_hz, question.natural_hz
    if not every.size or np.any((every >= lowest) & (every <= highest)):
        return ()
    near = float(every[np.argmin(np.maximum(lowest - every, every - highest))])
    why = (
        f"no natural frequency lies between {lowest:.2f} and {highest:.2f} Hz, neither with open nor with stuck contacts; the "
        f"nearest one is {near:.2f} Hz"
    )
    return (
        Verdict("doubtful", why=why, remedy=f"Widen forced_response.{question.key}: {proposed(question)} holds it."),
    )


def proposed(question: Question) -> str:
    """Return the key and a range of it that holds the nearest resonance, with open and stuck contacts if these are near, in words."""
    lowest, highest = question.driven_hz
    states = [hertz[hertz > STILL_HZ] for hertz in question.natural_states]
    off = [np.maximum(lowest - hertz, hertz - highest) for hertz in states]
    ends = {float(hertz[np.argmin(far)]) for hertz, far in zip(states, off, strict=True) if hertz.size}
    near = min(ends, key=lambda f: max(lowest - f, f - highest))
    together = [f for f in ends if max(f, near) < MOVED * min(f, near)]
    return range_around(question, min(together), max(together))


def range_around(question: Question, low: float, high: float, aside: float = ASIDE) -> str:
    """Return the key of the range and values of it around two driven frequencies in Hz, with a share beside them."""
    values = np.array([low * (1.0 - aside), high * (1.0 + aside)]) / question.driven[0]
    if question.over_speed:
        values = values * HZ / RPM / (question.model.engine_order or 1)
    first, last = (f"{value:.{max(3, len(f'{value:.0f}'))}g}" for value in values)
    return f"{question.key} = [{first}, {last}]"


def _of_drift(question: Question, response: Response) -> Iterator[Verdict]:
    """Doubt a body whose mean position is left free by friction."""
    chosen = [a.point for a in response.accepted if not a.point.converged]
    if response.top is not None:
        chosen = [response.top.point, *chosen]
    for point in chosen:
        found = drift(question.problem, point)
        if found.undetermined:
            why = (
                f"at {point.omega / HZ:.2f} Hz every contact slips or opens in each cycle, the mean position of {found.coordinate} "
                "is undetermined and the body may drift"
            )
            remedy = (
                "Give [retention] a small stiffness_n_per_m (1e-6 of the contact stiffness); the result then says how far it "
                "moves the peak. A part that is no rigid body needs a weak spring to the ground."
            )
            yield Verdict("doubtful", why=why, remedy=remedy)
            return


def _of_retention(question: Question, response: Response, shift: tuple[float, float]) -> Iterator[Verdict]:
    if question.model.retention > 0.0 and response.top is not None and math.isnan(shift[0]):
        why = (
            "no periodic motion was found at the peak with a tenth of the retention stiffness; the peak rests on the body being "
            "held"
        )
        remedy = "Do not rely on it: find what holds the body, or give it a contact that does."
        yield Verdict("doubtful", why=why, remedy=remedy)
