"""The check inside a run: the same reduced model integrated in time at three frequencies."""

from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np

from stickslip.response.fields import signals
from stickslip.response.forced import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.transient import TransientStart, integrate
from stickslip.study.build import Case
from stickslip.study.collect import HZ, Accepted, CaseResult
from stickslip.study.journal import Journal

FLANK = 0.5  # share of the peak amplitude at which the two frequencies beside the peak are taken


@dataclass(frozen=True)
class Check:
    """First-harmonic amplitude of the report output by balance and by time integration.

    Parameters
    ----------
    load_case
        Position of the load case.
    frequency_hz
        Where.
    balance, transient
        Amplitudes in m.
    settled
        Whether the integration became periodic.
    periods
        Periods integrated.
    """

    load_case: int
    frequency_hz: float
    balance: float
    transient: float
    settled: bool
    periods: int

    @property
    def difference_percent(self) -> float:
        """Of the balance against the integration."""
        return 100 * (self.balance - self.transient) / self.transient


def verify(
    case: Case, results: list[CaseResult], journal: Journal, say: Callable[[str], None]
) -> list[Check]:
    """Integrate near the peak of the most nonlinear load case and on both of its flanks.

    Parameters
    ----------
    case, results
        The model, and its finished load cases.
    journal
        Where finished integrations are kept; none is computed twice.
    say
        Takes a line of progress.
    """
    load_case = int(np.argmin([r.ratio for r in results]))
    checks = []
    for accepted in _three(results[load_case]):
        name = f"verify.{load_case}.{accepted.point.omega!r}"
        known = journal.get(name)
        check = Check(**known) if known else _check(case, results[load_case], load_case, accepted)
        journal.put(name, asdict(check))
        say(
            f"time integration at {check.frequency_hz:.2f} Hz: {check.transient:.4e} m against {check.balance:.4e} m "
            f"by balance ({check.difference_percent:+.2f} %), {check.periods} periods"
            + ("" if check.settled else "; it did NOT become periodic")
        )
        checks.append(check)
    return checks


def _three(result: CaseResult) -> list[Accepted]:
    """Return the peak and the point nearest to half of it on either side."""
    if result.peak < 0:
        return []
    peak = result.accepted[result.peak]
    output = result.report_output
    chosen = [peak]
    for side in (-1, 1):
        flank = [
            a
            for a in result.accepted
            if a.fields is not None and side * (a.point.omega - peak.point.omega) > 0
        ]
        if flank:
            wanted = FLANK * result.peak_amplitude
            chosen.append(min(flank, key=lambda a: abs(a.amplitudes(output + 1)[output] - wanted)))
    return sorted(chosen, key=lambda a: a.point.omega)


def _check(case: Case, result: CaseResult, load_case: int, accepted: Accepted) -> Check:
    point, output = accepted.point, result.report_output
    system, load = case.system, case.load(result.ratio)
    found = integrate(
        system.structure,
        system.interface.gap_operator,
        system.interface.laws,
        load,
        point.omega,
        system.outputs,
        start=_start(forced_problem(system, load, case.sweep), point),
    )
    return Check(
        load_case=load_case,
        frequency_hz=point.omega / HZ,
        balance=float(accepted.amplitudes(output + 1)[output]),
        transient=float(np.abs(found.harmonics[1, output])),
        settled=bool(found.settled),
        periods=int(found.periods),
    )


def _start(problem: ForcedProblem, point: ForcedPoint) -> TransientStart:
    """Return the balance's state at t = 0: near what is judged, so that little has to settle."""
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    rate = 1j * point.omega * np.arange(len(motion))[:, None]
    return TransientStart(
        displacement=motion.real.sum(axis=0),
        velocity=(rate * motion).real.sum(axis=0),
        traction=signals(problem, point).force[:, :2, 0],
    )
