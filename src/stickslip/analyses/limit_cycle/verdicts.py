"""Verdicts on limit cycles, and the terminal tables."""

import numpy as np
import xarray as xr

from stickslip.analyses.columns import number, record_of, told_apart
from stickslip.analyses.limit_cycle.records import Cycle, CycleBranch, LimitCycles
from stickslip.response.self_excited.in_time import UNSETTLED
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, millimetres

IN_TIME_RTOL = 1e-3  # largest relative difference of time integration from a cycle, in amplitude or frequency
MORE = "Raise limit_cycle.most_harmonics."


def case_verdicts(label: str, found: LimitCycles) -> list[Verdict]:
    """Return the verdicts on a case."""
    if found.linear_damping_ratio is None:
        return []
    if not found.branches:
        why = (
            f"no mode computed grows with contacts stuck; the least damping ratio is {100 * found.least_damping:.3g} %"
        )
        return [Verdict("trusted", label, None, why, "There is no limit cycle that begins with a linear instability.")]
    verdicts = _not_followed(label, found)
    for branch in found.branches:
        verdicts += _of_branch(label, found, branch)
    if found.outcome:
        verdicts.append(_of_competition(label, found.outcome, found))
    if found.outcome_missing:
        why = f"what becomes of all unstable waves together was not found in time: {found.outcome_missing}"
        verdicts.append(Verdict("doubtful", label, None, why, "Each wave is answered by itself."))
    return verdicts


def _of_competition(label: str, outcome: str, found: LimitCycles) -> Verdict:
    why = f"from a mixed start of all unstable waves, in time, {outcome}"
    if not outcome.startswith(UNSETTLED) or found.wave_amplitude is None:
        return Verdict("trusted", label, None, why, "That may depend on the start.")
    last = found.wave_amplitude[-1]
    wave = int(np.argmax(last))
    there = f" (wave {wave} has {millimetres(last[wave])}{_stable_of(found, wave)})"
    remedy = "limit_cycle.periods were too few to settle: raise it."
    return Verdict("doubtful", label, None, why + there, remedy)


def _stable_of(found: LimitCycles, wave: int) -> str:
    """Name the stable limit cycles of a wave."""
    own = [f"{millimetres(c.amplitude)}" for b, c in found.cycles if c.stability == "stable" and b.wave_number == wave]
    return f"; its stable limit cycle {' or '.join(own)}" if own else ""


def _not_followed(label: str, found: LimitCycles) -> list[Verdict]:
    """Note growing modes that were not followed, because the study names others."""
    ratios, hertz = found.linear_damping_ratio, found.linear_frequency_hz
    assert ratios is not None
    assert hertz is not None
    grows = int(np.count_nonzero(ratios < 0.0))
    left = grows - sum(branch.ratio < 0.0 for branch in found.branches)
    if left <= 0:
        return []
    worst = np.unravel_index(np.nanargmin(ratios), ratios.shape)
    why = (
        f"{left} of {grows} modes that grow with contacts stuck were not followed; the least damping ratio is {100 * ratios[worst]:.3g} % "
        f"at {hertz[worst]:.5g} Hz"
    )
    return [Verdict("trusted", label, None, why, "Leave limit_cycle.modes out: then all that grow are followed.")]


def _of_branch(label: str, found: LimitCycles, branch: CycleBranch) -> list[Verdict]:
    if branch.problem:
        return [Verdict("doubtful", label, None, f"{branch.name}: {branch.problem.removesuffix('.')}")]
    verdicts = [v for cycle in branch.cycles for v in _of_cycle(label, found, branch, cycle)]
    if branch.lost_cycles:
        why = f"{branch.name}: the damping has {branch.lost_cycles} more zeros than there are limit cycles here"
        verdicts.append(Verdict("doubtful", label, None, why, "Raise limit_cycle.points or limit_cycle.harmonics."))
    if branch.unbounded:
        why = (
            f"{branch.name}: friction cannot bound it; its damping ratio is {100 * branch.ratio:.3g} % with contacts stuck and "
            f"{100 * branch.largest_damping_ratio:.3g} % at most over the amplitudes looked at"
        )
        remedy = "Give more damping or friction, or look at larger amplitudes (limit_cycle.amplitude_mm)."
        verdicts.append(Verdict("trusted", label, None, why, remedy, warns=True))
    return verdicts


def _of_cycle(label: str, found: LimitCycles, branch: CycleBranch, cycle: Cycle) -> list[Verdict]:
    hertz = cycle.omega / HZ
    what = f"{branch.name}: the limit cycle of {millimetres(cycle.amplitude)}"
    verdicts = []
    if not cycle.enough:
        by = (
            "was solved with one set of harmonics alone"
            if np.isnan(cycle.change)
            else f"still moves by {100 * cycle.change:.2g} % with twice the harmonics"
        )
        verdicts.append(Verdict("doubtful", label, hertz, f"{what} {by}", MORE))
    if cycle.attracting and cycle.stability == "unstable":
        by = _named_disturbance(branch, cycle)
        why = f"{what} is stable in its own amplitude, but {by} grows: {cycle.reason}"
        verdicts.append(Verdict("trusted", label, hertz, why, f"The machine leaves it; {_what_tells(found)}."))
    elif cycle.attracting and cycle.stability != "stable":
        why = f"{what} is stable in its own amplitude; other disturbances are {cycle.stability}: {cycle.reason}"
        verdicts.append(Verdict("doubtful", label, hertz, why, "limit_cycle.in_time tells more."))
    if cycle.stability != "unstable":  # a motion in time leaves an unstable cycle
        verdicts += _of_time(label, what, cycle)
    return verdicts


def _named_disturbance(branch: CycleBranch, cycle: Cycle) -> str:
    """Name the growing disturbance; in the cycle's own wave it has another frequency and modulates the cycle."""
    wave, hertz = cycle.growing_wave, cycle.growing_omega / HZ
    if wave < 0:
        return "another motion"
    if wave == branch.wave_number:
        return f"a modulation of it, by wave {wave} itself at {hertz:.5g} Hz,"
    return f"wave {wave} at {hertz:.5g} Hz"


def _what_tells(found: LimitCycles) -> str:
    """Return a clause on the motion that a machine reaches after it leaves a limit cycle, or on the way to find it."""
    if found.outcome:
        return f"from a mixed start of all unstable waves, in time: {found.outcome}"
    if any(cycle.time_amplitude is not None for _, cycle in found.cycles):
        return "time integration began beside it, and its last amplitude is in the result"
    return "limit_cycle.in_time tells for what"


def _of_time(label: str, what: str, cycle: Cycle) -> list[Verdict]:
    if cycle.time_amplitude is None:
        return []
    away = abs(cycle.time_amplitude / cycle.amplitude - 1.0)
    if not np.isfinite(away) or away <= IN_TIME_RTOL:
        return []
    why = f"{what} is {100 * away:.2g} % off where time integration was at its end"
    return [
        Verdict(
            "doubtful",
            label,
            cycle.omega / HZ,
            why,
            "Give it more limit_cycle.periods, or look at its stability.",
        )
    ]


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables: the limit cycles of each case."""
    return tuple(table for case, head in told_apart(data) for table in _tables(record_of(LimitCycles, case), head))


def _tables(found: LimitCycles, head: str) -> list[TextTable]:
    if not found.branches:
        return []
    modes = tuple(
        (
            branch.name,
            f"{branch.omega / HZ:.6g}",
            f"{100 * branch.ratio:+.4g}",
            number(1e3 * branch.slip_amplitude),
            f"{100 * branch.largest_damping_ratio:+.4g}",
        )
        for branch in found.branches
    )
    columns = ("mode", "Hz, stuck", "damping %", "slips from mm", "most damping %")
    made = [TextTable(f"{head}Modes over the amplitude of {found.output}", columns, modes)]
    if not found.cycles:
        return made
    cycles = tuple(
        (
            branch.name,
            number(1e3 * cycle.amplitude),
            f"{cycle.omega / HZ:.6g}",
            "attracting" if cycle.attracting else "repelling",
            f"{cycle.stability}{grows(cycle)}",
            str(cycle.harmonics),
        )
        for branch, cycle in found.cycles
    )
    names = ("mode", "amplitude mm", "Hz", "in its amplitude", "against all disturbances", "H")
    return [*made, TextTable(f"{head}Limit cycles", names, cycles)]


def grows(cycle: Cycle) -> str:
    """Return the wave that grows at an unstable cycle, as a text after the word ``unstable``."""
    return f", wave {cycle.growing_wave}" if cycle.growing_wave >= 0 and cycle.stability == "unstable" else ""
