"""Verdicts on nonlinear modes, and the terminal tables."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stickslip.analyses.columns import number, record_of, told_apart
from stickslip.analyses.nonlinear_mode.records import ModeBranch, NonlinearModes
from stickslip.response.nonlinear_modes.backbone import MEETS, OVER
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres, millimetres_between

NONE = 1e-9  # damping ratio of an undamped mode, at most
LIFTS, AGAIN = "lift-off", "taken up again"  # parts of the text `Backbone.end`


def case_verdicts(label: str, found: NonlinearModes) -> list[Verdict]:
    """Return the verdicts on a case."""
    each = [_of_branch(label, found, branch) for branch in found.branches]
    sound = [b for b, own in zip(found.branches, each, strict=True) if all(v.level == "trusted" for v in own)]
    verdicts = [v for own in each for v in own]
    return [*verdicts, Verdict("trusted", label, None, _followed(found, sound))] if sound else verdicts


AT_AN_END = 1e-6  # relative distance of two amplitudes that are the same


def _followed(found: NonlinearModes, sound: Sequence[ModeBranch]) -> str:
    """State the range of amplitudes of the modes without doubts, and their largest damping ratio."""
    every = len(found.branches)
    amplitude = np.concatenate([branch.amplitude for branch in sound])
    most = sound[int(np.argmax([branch.largest_damping_ratio for branch in sound]))]
    ratio, at = most.largest_damping_ratio, most.largest_damping_amplitude
    who = most.name if every == 1 else f"{len(sound)} of {every} modes"
    damping = f"the largest damping ratio is {100 * ratio:.3g} %" if abs(ratio) > NONE else "without damping"
    where = f" at {millimetres(at)}" if abs(ratio) > NONE else ""
    ends = np.nanmin(most.amplitude), np.nanmax(most.amplitude)
    end = ", an end of the range: it may be larger beyond" * bool(where and np.isclose(at, ends, rtol=AT_AN_END).any())
    of = f", of {most.name}" if every > 1 and where else ""
    sizes = millimetres_between(float(np.nanmin(amplitude)), float(np.nanmax(amplitude)))
    return f"{who} followed from {sizes}: {damping}{where}{of}{end}{_by_the_other_concept(found, most)}"


def _by_the_other_concept(found: NonlinearModes, branch: ModeBranch) -> str:
    """State the damping ratio by the other concept at the largest damping; empty if both agree within the accuracy."""
    ratio, other = branch.largest_damping_ratio, branch.other_damping_ratio
    if other is None or abs(ratio) <= NONE or abs(other - ratio) <= branch.accuracy * abs(ratio):
        return ""
    motions = "periodic motions" if found.concept == "decaying" else "decaying motions"
    return f"; {motions} give {100 * other:.3g} % there" if np.isfinite(other) else f"; no {motions} are near"


def _of_branch(label: str, whole: NonlinearModes, branch: ModeBranch) -> list[Verdict]:
    name, problem, end = branch.name, branch.problem, branch.end
    if problem:
        return [Verdict("doubtful", label, None, f"{name}: {problem.removesuffix('.').removeprefix(f'{name}: ')}")]
    found = []
    if end.startswith(LIFTS):
        why = f"{name}: {end}"
        found.append(
            Verdict(
                "trusted",
                label,
                None,
                why,
                "Beyond it contacts hold nothing together that vibrates periodically in this mode.",
            )
        )
    elif not end.startswith(("amplitude reached", "gross slip")):
        found.append(Verdict("doubtful", label, None, f"{name}: {end}", "Give it more points, or more harmonics."))
    found += _of_resonances(label, whole, branch)
    status = branch.status
    gaps = int(np.count_nonzero(status > 0))
    solved = np.flatnonzero(status == 0)
    lost = solved.size > 0 and bool(np.any(status[: solved[-1]] > 0))
    if lost or AGAIN in end:
        why = f"{name}: it was lost and taken up again further on; {gaps} of its points are no motions"
        found.append(Verdict("doubtful", label, None, why, "What lies beyond may be another mode."))
    return found + _of_harmonics(label, branch)


def _of_resonances(label: str, whole: NonlinearModes, branch: ModeBranch) -> list[Verdict]:
    """Return the verdicts on internal resonances: harmonics that meet other modes."""
    name = branch.name
    told = [text for text in branch.end.split("; ") if MEETS in text]
    over = [text for text in told if text.startswith(OVER)]
    if over:
        remedy = "Give nonlinear_mode.amplitude_mm around it, with more points: other motions of the same amplitude exist there."
        return [Verdict("doubtful", label, None, f"{name}: {'; '.join(over)}", remedy)]
    if not told:
        return []
    if (most := branch.most_on_resonance) is not None:
        sizes = branch.amplitude[branch.resonant]
        reach = millimetres_between(float(np.nanmin(sizes)), float(np.nanmax(sizes)))
        top = f"up to {100 * branch.damping_ratio[most]:.3g} % damping at {millimetres(branch.amplitude[most])}"
        own = f"{100 * branch.largest_damping_ratio:.3g} % at {millimetres(branch.largest_damping_amplitude)}"
        why = f"{name}: {'; '.join(told)}, which takes part from {reach} and gives {top}; elsewhere {name} has at most {own}"
        why += _by_the_other_concept(whole, branch)
        other = "periodic" if whole.concept == "decaying" else "decaying"
        remedy = f'Compare nonlinear_mode.concept = "{other}", and the peak of a forced response of that amplitude.'
        return [Verdict("doubtful", label, None, why, remedy)]
    remedy = "Several motions of one amplitude may exist there, and a forced response near it has more than one peak."
    return [Verdict("trusted", label, None, f"{name}: {'; '.join(told)}", remedy, warns=True)]


def _of_harmonics(label: str, branch: ModeBranch) -> list[Verdict]:
    """Doubt a mode whose frequency or damping ratio still changes with more harmonics."""
    name, change = branch.name, branch.change[branch.status == 0]
    if change.size and np.all(np.isnan(change)):
        why = f"{name}: was solved with one set of harmonics alone"
        return [Verdict("doubtful", label, None, why, "Raise nonlinear_mode.most_harmonics.")]
    above = change[change > branch.accuracy]
    if not above.size:
        return []
    most = float(above[np.isfinite(above)].max(initial=0.0))
    by = f"by up to {100 * most:.2g} %" if most else "by an unknown amount"
    why = f"{name}: frequency or damping ratio of {above.size} of its {change.size} motions still change {by} with the last harmonics"
    return [
        Verdict(
            "doubtful", label, None, why, "Raise nonlinear_mode.most_harmonics, or nonlinear_mode.accuracy_percent."
        )
    ]


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables: the modes of each case."""
    every = ((record_of(NonlinearModes, case), head) for case, head in told_apart(data))
    return tuple(_table(found, head) for found, head in every if found.branches)


def _table(found: NonlinearModes, head: str) -> TextTable:
    rows = []
    for branch in found.branches:
        known = branch.frequency_hz[np.isfinite(branch.frequency_hz)]
        rows.append(
            (
                branch.name,
                f"{branch.mode_frequency_hz:.6g}",
                f"{known.min():.6g} to {known.max():.6g}" if known.size else "-",
                f"{100 * branch.mode_damping_ratio:+.4g}",
                number(100 * branch.largest_damping_ratio),
                number(1e3 * branch.largest_damping_amplitude),
                branch.problem or branch.end,
            )
        )
    columns = ("mode", "Hz, stuck", "Hz", "damping %, stuck", "most damping %", "at mm", "end")
    return TextTable(f"{head}Nonlinear modes over the amplitude of {found.output}", columns, tuple(rows))
