"""Verdicts on limit cycles, and the terminal tables."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stickslip.analyses.collected import number, told_apart
from stickslip.response.self_excited.in_time import UNSETTLED
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres

IN_TIME_RTOL = 1e-3  # of amplitude or frequency, by which time integration may be off a cycle
MORE = "Raise limit_cycle.most_harmonics."


def case_verdicts(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return what is to be thought of a case from its variables."""
    if "linear_damping_ratio" not in case:
        return []
    if "wave_number" not in case:
        least = float(np.nanmin(case["linear_damping_ratio"].values))
        why = f"no mode that was looked at grows with contacts stuck: the least damping ratio is {100 * least:.3g} %"
        return [Verdict("trusted", label, None, why, "There is no limit cycle that begins with a linear instability.")]
    found = _not_followed(label, case)
    for i in range(case["wave_number"].size):
        found += _of_branch(label, case, i)
    outcome = str(case["outcome"].values) if "outcome" in case else ""
    if outcome:
        found.append(_of_competition(label, outcome, case))
    missing = str(case["outcome_missing"].values) if "outcome_missing" in case else ""
    if missing:
        why = f"what becomes of all unstable waves together was not found in time: {missing}"
        found.append(Verdict("doubtful", label, None, why, "Each wave is answered by itself."))
    return found


def _of_competition(label: str, outcome: str, case: Mapping[str, xr.Variable]) -> Verdict:
    why = f"from a mixed start of all unstable waves, in time, {outcome}"
    if not outcome.startswith(UNSETTLED):
        return Verdict("trusted", label, None, why, "That may depend on the start.")
    last = case["wave_amplitude"].values[-1]
    wave = int(np.argmax(last))
    there = f" (wave {wave} has {millimetres(last[wave])}{_stable_of(case, wave)})"
    remedy = "limit_cycle.periods were too few to settle: raise it."
    return Verdict("doubtful", label, None, why + there, remedy)


def _stable_of(case: Mapping[str, xr.Variable], wave: int) -> str:
    """Name the stable limit cycles of a wave."""
    own = [
        f"{millimetres(float(case['cycle_amplitude'].values[c]))}"
        for c in _cycles(case)
        if str(case["cycle_stability"].values[c]) == "stable"
        and int(case["wave_number"].values[int(case["cycle_branch"].values[c])]) == wave
    ]
    return f"; its stable limit cycle {' or '.join(own)}" if own else ""


def _not_followed(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Say that modes grow which were looked at and not asked for."""
    ratios, hertz = (case[f"linear_{n}"].values for n in ("damping_ratio", "frequency_hz"))
    grows = int(np.count_nonzero(ratios < 0.0))
    left = grows - int(np.count_nonzero(case["mode_damping_ratio"].values < 0.0))
    if left <= 0:
        return []
    worst = np.unravel_index(np.nanargmin(ratios), ratios.shape)
    why = (
        f"{left} of {grows} modes that grow with contacts stuck were not followed; the least damping ratio is {100 * ratios[worst]:.3g} % "
        f"at {hertz[worst]:.5g} Hz"
    )
    return [Verdict("trusted", label, None, why, "Leave limit_cycle.modes out: then all that grow are followed.")]


def branch_name(case: Mapping[str, xr.Variable] | xr.Dataset, i: int) -> str:
    """Return the name of a mode of a wave."""
    wave, mode = (int(np.asarray(case[n].values)[i]) for n in ("wave_number", "mode"))
    return f"mode {mode}" if wave < 0 else f"wave {wave}, mode {mode}"


def _of_branch(label: str, case: Mapping[str, xr.Variable], i: int) -> list[Verdict]:
    name = branch_name(case, i)
    problem = str(case["problem"].values[i])
    if problem:
        return [Verdict("doubtful", label, None, f"{name}: {problem.removesuffix('.')}")]
    ratio = float(case["mode_damping_ratio"].values[i])
    own = [c for c in _cycles(case) if case["cycle_branch"].values[c] == i]
    found = [v for c in own for v in _of_cycle(label, name, case, c)]
    if lost := int(case["lost_cycles"].values[i]):
        why = f"{name}: the damping has {lost} more zeros than there are limit cycles here"
        found.append(Verdict("doubtful", label, None, why, "Raise limit_cycle.points or limit_cycle.harmonics."))
    most = 100 * float(case["largest_damping_ratio"].values[i])
    if ratio < 0.0 and not most > 0.0:
        why = (
            f"{name}: friction cannot bound it: its damping ratio is {100 * ratio:.3g} % with contacts stuck and {most:.3g} % at most "
            "over the amplitudes looked at"
        )
        found.append(
            Verdict(
                "trusted",
                label,
                None,
                why,
                "Give more damping or friction, or look at larger amplitudes (limit_cycle.amplitude_mm).",
                warns=True,
            )
        )
    return found


def _of_cycle(label: str, name: str, case: Mapping[str, xr.Variable], c: int) -> list[Verdict]:
    amplitude, hertz = (float(case[f"cycle_{n}"].values[c]) for n in ("amplitude", "frequency_hz"))
    what = f"{name}: the limit cycle of {millimetres(amplitude)}"
    found = []
    if not case["cycle_enough"].values[c]:
        change = float(case["cycle_change"].values[c])
        by = (
            "was solved with one set of harmonics alone"
            if np.isnan(change)
            else f"still moves by {100 * change:.2g} % with twice the harmonics"
        )
        found.append(Verdict("doubtful", label, hertz, f"{what} {by}", MORE))
    word, reason = (str(case[n].values[c]) for n in ("cycle_stability", "cycle_reason"))
    attracting = float(case["cycle_slope"].values[c]) > 0.0
    wave = int(case["cycle_growing_wave"].values[c])
    if attracting and word == "unstable":
        by = _named_disturbance(case, c, wave)
        why = f"{what} is stable in its own amplitude, but {by} grows: {reason}"
        found.append(Verdict("trusted", label, hertz, why, f"The machine leaves it; {_what_tells(case)}."))
    elif attracting and word != "stable":
        why = f"{what} is stable in its own amplitude; other disturbances are {word}: {reason}"
        found.append(Verdict("doubtful", label, hertz, why, "limit_cycle.in_time tells more."))
    if "cycle_time_amplitude" in case and word != "unstable":  # what is left is elsewhere in time
        found += _of_time(label, what, case, c)
    return found


def _named_disturbance(case: Mapping[str, xr.Variable], c: int, wave: int) -> str:
    """Say what grows; of the cycle's own wave it is a motion at another frequency beside it, which modulates it."""
    if wave < 0:
        return "another motion"
    own = int(case["wave_number"].values[int(case["cycle_branch"].values[c])])
    hertz = float(case["cycle_growing_frequency_hz"].values[c])
    return (
        f"a modulation of it, by wave {wave} itself at {hertz:.5g} Hz,"
        if wave == own
        else f"wave {wave} at {hertz:.5g} Hz"
    )


def _what_tells(case: Mapping[str, xr.Variable]) -> str:
    """Return what tells to which motion a machine goes that leaves a limit cycle."""
    outcome = str(case["outcome"].values) if "outcome" in case else ""
    if outcome:
        return f"from a mixed start of all unstable waves, in time: {outcome}"
    if "cycle_time_amplitude" in case:
        return "time integration began beside it, and its last amplitude is in the result"
    return "limit_cycle.in_time tells for what"


def _of_time(label: str, what: str, case: Mapping[str, xr.Variable], c: int) -> list[Verdict]:
    amplitude, hertz = (float(case[f"cycle_{n}"].values[c]) for n in ("amplitude", "frequency_hz"))
    there = float(case["cycle_time_amplitude"].values[c])
    away = abs(there / amplitude - 1.0)
    if not np.isfinite(away) or away <= IN_TIME_RTOL:
        return []
    why = f"{what} is {100 * away:.2g} % off where time integration was at its end"
    return [Verdict("doubtful", label, hertz, why, "Give it more limit_cycle.periods, or look at its stability.")]


def _cycles(case: Mapping[str, xr.Variable]) -> range:
    return range(case["cycle_amplitude"].size if "cycle_amplitude" in case else 0)


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints: the limit cycles of each case."""
    return tuple(table for case, head in told_apart(data) for table in _tables(case, head))


def _tables(case: xr.Dataset, head: str) -> list[TextTable]:
    if "wave_number" not in case:
        return []
    rows = [
        (
            branch_name(case, i),
            f"{float(case['mode_frequency_hz'][i]):.6g}",
            f"{100 * float(case['mode_damping_ratio'][i]):+.4g}",
            number(1e3 * float(case["slip_amplitude"][i])),
            f"{100 * float(case['largest_damping_ratio'][i]):+.4g}",
        )
        for i in range(case.sizes["branch"])
    ]
    columns = ("mode", "Hz, stuck", "damping %", "slips from mm", "most damping %")
    found = [TextTable(f"{head}Modes over the amplitude of {case.attrs.get('output', '')}", columns, tuple(rows))]
    if "cycle_amplitude" not in case:
        return found
    cycles = []
    for c in range(case.sizes["cycle"]):
        wave = int(case["cycle_growing_wave"][c])
        grows = f", wave {wave}" if wave >= 0 and str(case["cycle_stability"][c].values) == "unstable" else ""
        cycles.append(
            (
                branch_name(case, int(case["cycle_branch"][c])),
                number(1e3 * float(case["cycle_amplitude"][c])),
                f"{float(case['cycle_frequency_hz'][c]):.6g}",
                "attracting" if float(case["cycle_slope"][c]) > 0.0 else "repelling",
                f"{case['cycle_stability'][c].values!s}{grows}",
                str(int(case["cycle_harmonics"][c])),
            )
        )
    names = ("mode", "amplitude mm", "Hz", "in its amplitude", "against all disturbances", "H")
    return [*found, TextTable(f"{head}Limit cycles", names, tuple(cycles))]
