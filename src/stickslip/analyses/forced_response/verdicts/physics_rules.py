"""Rules on physics and model: impossible physics, sensitivity to the model, other motions."""

from collections.abc import Iterator

import numpy as np

from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.finding import Finding, Rule
from stickslip.study.verdict import from_json
from stickslip.units import millimetres

LARGEST_ROTATION_RAD = 0.1  # that linear kinematics describes
LARGEST_STRAIN = 3e-3
LARGER = 0.01  # relative, than the peak
SOFTER = 0.1  # relative change of the contact stiffness that sentences are about
DECIDED = 0.05  # relative change of a peak by it above which a note says so
LEAST_PERCENT, LEAST_HZ = 1e-3, 1e-6  # changes of a peak that are told as numbers
LARGEST_SLIP_FACETS = 0.5  # of a facet: contact points stay opposite each other


def physics(case: Curve) -> Iterator[Finding]:
    """Return what the modes say of the physics of the case."""
    for v in from_json(case.text("physics_verdicts") or "[]"):
        yield Finding(v.level, v.why, v.remedy)


def small_motions(case: Curve) -> Iterator[Finding]:
    """Doubt motions that linear kinematics does not describe."""
    rotation, strain, slip = (case.number(f"peak_{name}") for name in ("rotation_rad", "strain_rms", "slip_facets"))
    told = [f"a part turns by {rotation:.2g} rad, more than {LARGEST_ROTATION_RAD:g}"] * bool(
        rotation > LARGEST_ROTATION_RAD
    )
    told += [
        f"the root mean square of the strain is {100 * strain:.2g} %, more than {100 * LARGEST_STRAIN:g} %"
    ] * bool(strain > LARGEST_STRAIN)
    told += [f"a contact slips by {slip:.2g} of a facet, more than {LARGEST_SLIP_FACETS:g}"] * bool(
        slip > LARGEST_SLIP_FACETS
    )
    if told:
        why = f"the motion at the peak is too large for linear kinematics: {'; '.join(told)}"
        remedy = (
            "Check units, the size of the loads and the damping; if they are right, a model of large motions is needed."
        )
        yield Finding("doubtful", why, remedy)


def model_itself(case: Curve) -> Iterator[Finding]:
    """Doubt a peak that more modes, or fewer contact points, would move by more than the threshold."""
    for name, what, remedy in (
        ("modes", "with half again as many modes in the reduction", "Keep more modes ([reduction] modes)."),
        (
            "points",
            f"with half the points of its contacts ({case.number('points_left_out'):.0f} left out)",
            "Mesh the contacts more finely, and compare.",
        ),
    ):
        change, hertz = (case.number(f"{name}_{own}") for own in ("peak_change", "frequency_change_hz"))
        if abs(change) > case.limit:
            why = f"the peak changes by {100 * change:+.2g} % and {hertz:+.3g} Hz {what}"
            yield Finding("doubtful", why, remedy)


def other_motions(case: Curve) -> Iterator[Finding]:
    """Tell of motions beside that of the response; doubt a peak that one of them is larger than."""
    for said in case.rows("another"):
        size, hz = float(said["another_amplitude"]), float(said["another_frequency_hz"])
        larger = size > (1.0 + LARGER) * float(np.nan_to_num(case.number("peak_amplitude")))
        word = str(said["another_stability"])
        state = {
            "stable": ", which is stable",
            "undecided": ", of which nobody knows whether it is stable",
            "neutral": ", which is neutral",
        }.get(word, ", whose stability was not examined")
        why = (
            f"another motion of {millimetres(size)} exists at {hz:.2f} Hz, where the response has {millimetres(float(said['another_known']))}: "
            f"found from {said['another_start']}{state}"
        )
        remedy = "Which one a machine takes depends on its history: [all_motions] looks for all of them."
        yield Finding("doubtful" if larger else "trusted", why, remedy, size=size)


def contact_stiffness(case: Curve) -> Iterator[Finding]:
    """Tell of a peak that contacts a tenth softer would move by more than `DECIDED`: no doubt, the number is only as good as its stiffness."""
    if abs(SOFTER * case.number("stiffness_peak_slope")) > DECIDED:
        yield Finding(
            "trusted",
            f"the contact stiffness decides the peak: {_softer(case)}",
            "Know it to a few per cent, from a measured stuck frequency for example, or vary it ([vary]).",
        )


def _softer(case: Curve) -> str:
    """Return what softer contacts do to a peak, to first order; empty where that is not known."""
    slope, hertz = (case.number(f"stiffness_{own}") for own in ("peak_slope", "frequency_slope_hz"))
    if not np.isfinite(slope):
        return ""
    percent = -100 * SOFTER * slope
    size = f"{percent:+.2g} %" if abs(percent) >= LEAST_PERCENT else f"less than {LEAST_PERCENT:g} %"
    moved = f" and {-SOFTER * hertz:+.2g} Hz" if abs(hertz) >= LEAST_HZ else ""
    return f"contacts {100 * SOFTER:g} % softer change it by {size}{moved}"


def told_of_model(case: Curve) -> list[str]:
    """Return what the modes, the contact points and the contact stiffness of a model change at a peak that is trusted."""
    told = []
    for name, what in (("modes", "half again as many modes"), ("points", "half the contact points")):
        change, hertz = (case.number(f"{name}_{own}") for own in ("peak_change", "frequency_change_hz"))
        if np.isfinite(change):
            told.append(f"{what} change it by {100 * change:+.2g} % and {hertz:+.2g} Hz")
    return told + [said for said in (_softer(case),) if said]


PHYSICS_RULES: tuple[Rule, ...] = (physics, small_motions, model_itself, contact_stiffness, other_motions)
