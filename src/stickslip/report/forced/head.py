"""The head of the page: what came out of a forced response in four numbers, and what is doubtful."""

import numpy as np

from stickslip.report.quantities import counted, number, percent, predicted, quantity, scale_for
from stickslip.report.response import Response
from stickslip.report.section import Card

_LARGE_SHIFT = 0.01  # relative change of the peak worth a warning
_LARGE_DIFFERENCE = 1.0  # percent between time integration and balance (Gastaldi and Berruti 2017: below it at H = 5)


def _peak_card(response: Response) -> Card:
    cases = [c for c in response.peaked if np.isfinite(response.peak_response(c))]
    if not cases:
        return Card("–", "peak", "no case has its peak yet")
    peaks = np.array([response.peak_response(c) for c in cases])
    best = int(np.argmin(peaks))
    scale = scale_for(peaks[best : best + 1], response.unit)
    size = f"{number(float(peaks[best]) * scale.factor)} {scale.unit}"
    if len(cases) == 1:
        more = (
            f", {quantity(float(peaks[0]) * cases[0].excitation, response.length)}"
            if response.per_force
            else ""
        )
        return Card(
            size,
            f"peak of {response.output_name}",
            f"at {number(response.peak_hz(cases[0]), 5)} Hz{more}",
        )
    end = "; at the end of the range" if best in (0, len(cases) - 1) else ""
    note = f"smallest peak of the cases, {percent(100 * float(peaks[best] / peaks.max()))} of the largest{end}"
    return Card(size, cases[best].label, note)


def _shift_card(response: Response) -> Card | None:
    if len(response.peaked) < 2:
        return None
    first, last = response.peaked[0], response.peaked[-1]
    a, b = response.peak_hz(first), response.peak_hz(last)
    note = f"from {number(a, 5)} Hz{first.where} to {number(b, 5)} Hz{last.where}"
    return Card(
        f"{number(b - a)} Hz",
        f"shift of the peak over the cases ({percent(100 * (b / a - 1))})",
        note,
    )


def _loss_card(response: Response) -> Card | None:
    """Return what one case loses at its peak; several have their shift instead."""
    if len(response.peaked) != 1 or not response.has("dissipated_energy"):
        return None
    energy = float(
        np.nansum(response.floats("dissipated_energy")[response.peak(response.peaked[0])])
    )
    return Card(
        quantity(energy if energy > 1e-12 else 0.0, "J"),
        "lost in a cycle at the peak",
        "by all contacts together",
    )


def _choice_card(response: Response) -> Card | None:
    error, n = response.alert.error, int(response.converged.sum())
    if not response.is_error or not response.decides:
        more = int(np.sum(response.more & response.converged))
        note = f"{more} of {counted(n, 'accepted point')}, chosen by {response.selection}"
        label = f"of points keep other harmonics than H = {response.low_name}"
        return (
            Card(f"{number(100 * more / n, 2)} %" if n else "–", label, note)
            if response.decides
            else None
        )
    if not error.size:
        return None
    asked = int(np.sum(error > response.threshold))
    note = f"{asked} of {counted(error.size, 'checked point')} above {percent(response.threshold)}"
    return Card(
        f"{number(100 * asked / error.size, 2)} %", "of points asked for more harmonics", note
    )


def _worst_card(response: Response) -> Card | None:
    asked = response.alert
    if not response.is_error or not response.decides:
        if not response.has("unknowns_solved", "newton_steps"):
            return None
        work, steps = (
            int(response.floats(name).sum()) for name in ("unknowns_solved", "newton_steps")
        )
        note = f"of all solutions together, in {counted(steps, 'Newton step')}"
        return Card(number(work, 6), "unknowns solved", note)
    if not asked.error.size:
        return None
    at = int(np.argmax(asked.error))
    note = f"at {number(float(asked.hz[at]), 5)} Hz{response.cases[asked.case[at]].where}"
    return Card(
        predicted(float(asked.error[at])),
        f"worst predicted error with H = {response.low_name}",
        note,
    )


def cards(response: Response) -> list[Card]:
    """Return the numbers that sum the response up."""
    found = (_peak_card, _shift_card, _loss_card, _choice_card, _worst_card)
    return [card for card in (make(response) for make in found) if card is not None]


def warnings(response: Response) -> list[str]:
    """Return what follows from the numbers: a peak that hangs on the retention, a check that failed."""
    found = []
    for case in response.cases:
        shift = np.nan_to_num(response.number_of("retention_peak_shift", case))
        if abs(shift) > _LARGE_SHIFT:
            found.append(
                f"{'For ' + case.label if case.label else 'Here'} the peak changes by {percent(100 * float(shift))} when the retention stiffness "
                "of rigid bodies is ten times smaller: it depends on a stiffness that is not physical."
            )
    if response.has("verify_difference_percent"):
        large = int(
            (
                np.abs(np.nan_to_num(response.floats("verify_difference_percent")))
                > _LARGE_DIFFERENCE
            ).sum()
        )
        if large:
            found.append(
                f"Time integration and harmonic balance differ by more than {percent(_LARGE_DIFFERENCE)} in "
                f"{counted(large, 'check')}; see the table."
            )
    if response.has("verify_settled") and (response.floats("verify_settled") == 0).any():
        found.append("A time integration did not settle to a periodic motion; see the table.")
    return found
