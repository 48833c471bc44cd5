"""The check inside a run: the same reduced model integrated in time at three frequencies."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from stickslip.contact.law import SLIP
from stickslip.errors import input_error, together
from stickslip.response.forced.response import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.recovery import signals
from stickslip.response.time.propagator import PeriodicLoad
from stickslip.response.time.transient import (
    TimeStepping,
    TransientResult,
    integrate,
    start_from_harmonics,
)
from stickslip.solve.newton_method import newton
from stickslip.study.build import Case
from stickslip.study.collect import HZ, Accepted, CaseResult
from stickslip.study.journal import Journal
from stickslip.study.schema import Study

CHECKS = 3
FLANK = 0.7  # share of the peak amplitude at which frequencies beside a peak are taken
PATIENCE = 600  # periods; a blade damped by 0.3 % forgets its start to 1e-5, undamped ringing of the damper never ends
LARGE = 1.0  # percent: above it the balance is repeated with more harmonics, to tell which of the two is wrong
NAMED = 3  # drifting coordinates that a sentence names
INTEGRABLE = "elastic_coulomb"  # the law that the time integration knows
MORE = 3  # times the harmonics, and the samples, of that repeat


@dataclass(frozen=True)
class Check:
    """First-harmonic amplitude of the report output by balance and by time integration.

    Parameters
    ----------
    load_case
        Position of the load case.
    ratio
        Its F_CL/F_HE.
    frequency_hz
        Where.
    balance, transient
        Amplitudes in m; of the integration the average over its last third where it did not become periodic.
    settled
        Whether the integration became periodic.
    periods
        Periods integrated.
    scatter
        Largest distance of a period's first harmonic from that average, relative to it; over all outputs.
    drifting
        Names of the coordinates whose mean moves on from period to period, with commas between them.
    order
        Harmonics of the balance.
    refined_order, refined
        Harmonics and amplitude of the balance repeated with more of them; NaN where it was not needed or failed.
    """

    load_case: int
    ratio: float
    frequency_hz: float
    balance: float
    transient: float
    settled: bool
    periods: int
    scatter: float = 0.0
    drifting: str = ""
    order: int = 0
    refined_order: int = 0
    refined: float = float("nan")

    @property
    def difference_percent(self) -> float:
        """Of the balance against the integration."""
        return 100 * (self.balance - self.transient) / self.transient

    @property
    def sentence(self) -> str:
        """What was compared and what happened."""
        return (
            f"F_CL/F_HE = {self.ratio:g}, {self.frequency_hz:.3f} Hz: balance {self.balance:.5e} m (H = {self.order}), "
            f"time integration {self.transient:.5e} m, difference {self.difference_percent:+.2f} %; "
            f"{self._motion}{self._verdict}"
        )

    @property
    def _motion(self) -> str:
        if not np.isfinite(self.transient):
            return f"the integration overflowed after {self.periods} periods"
        if self.settled:
            return f"periodic after {self.periods} periods"
        drifting = f", and these coordinates drift: {self.drifting}" if self.drifting else ""
        return (
            f"not periodic after {self.periods} periods: average over the last third, "
            f"scatter {100 * self.scatter:.2g} %{drifting}"
        )

    @property
    def _verdict(self) -> str:
        if self.refined_order == 0:
            return ""
        if not np.isfinite(self.refined):
            return f"; the balance with {self.refined_order} harmonics does not converge"
        left = 100 * (self.refined - self.transient) / self.transient
        return f"; the balance with {self.refined_order} harmonics gives {self.refined:.5e} m ({left:+.2f} %)"


def require_integrable(study: Study) -> None:
    """Refuse a check by time integration of laws that it does not know, before anything is computed.

    Raises
    ------
    InputError
        Naming every side of the damper that has such a law.
    """
    sides = {"flat": study.tables.contact.flat, "curved": study.tables.contact.curved}
    wrong = [
        input_error(
            f"{study.path}: contact.{name}.law",
            f"--verify integrates in time, which knows {INTEGRABLE} alone, got {side.law!r}",
            f"Run without --verify, or give the law {INTEGRABLE}.",
        )
        for name, side in sides.items()
        if side.law != INTEGRABLE
    ]
    if wrong:
        raise together(wrong)


def verify(
    case: Case, results: list[CaseResult], journal: Journal, say: Callable[[str], None]
) -> list[Check]:
    """Integrate at three frequencies that span the load cases, see `chosen`.

    Parameters
    ----------
    case, results
        The model, and its finished load cases.
    journal
        Where finished integrations are kept; none is computed twice.
    say
        Takes a line of progress.
    """
    checks = []
    for load_case, accepted in chosen(results):
        name = f"check.{load_case}.{accepted.point.omega!r}"
        known = journal.get(name)
        check = Check(**known) if known else _check(case, results[load_case], load_case, accepted)
        journal.put(name, asdict(check))
        say(f"time integration: {check.sentence}")
        checks.append(check)
    return checks


def chosen(results: list[CaseResult]) -> list[tuple[int, Accepted]]:
    """Return three points of the sweep with the positions of their load cases.

    They are the peaks of the first load case in which a contact slips, of the optimum (the smallest amplitude for a unit of
    excitation) and of the most nonlinear case. Where these are fewer than three, as in a study of one load case, points on the
    flanks of the peaks stand in.
    """
    peaked = [i for i, r in enumerate(results) if r.peak >= 0]
    if not peaked:
        return []
    ordered = sorted(peaked, key=lambda i: -results[i].ratio)
    slipping = [i for i in ordered if _slips(results[i])]
    optimum = min(ordered, key=lambda i: results[i].peak_amplitude / results[i].excitation)
    cases = list(dict.fromkeys([*slipping[:1], optimum, ordered[-1]]))
    candidates = [(i, results[i].accepted[results[i].peak]) for i in cases]
    candidates += [(i, flank) for i in cases for _, flank in peak_and_flanks(results[i])[1:]]
    return sorted(candidates[:CHECKS], key=lambda c: (c[0], c[1].point.omega))


def _slips(result: CaseResult) -> bool:
    return result.signals is not None and bool(np.any(result.signals.state == SLIP))


def peak_and_flanks(result: CaseResult) -> list[tuple[str, Accepted]]:
    """Return the peak and, on either side of it, the point whose amplitude is nearest to a share of the peak's."""
    if result.peak < 0:
        return []
    peak, output = result.accepted[result.peak], result.report_output
    wanted = FLANK * result.peak_amplitude
    found = [("peak", peak)]
    for name, side in (("below the peak", -1), ("above the peak", 1)):
        points = [
            a
            for a in result.accepted
            if a.fields is not None and side * (a.point.omega - peak.point.omega) > 0
        ]
        if points:
            nearest = min(points, key=lambda a: abs(a.amplitudes(output + 1)[output] - wanted))
            found.append((name, nearest))
    return found


def _check(case: Case, result: CaseResult, load_case: int, accepted: Accepted) -> Check:
    point, output = accepted.point, result.report_output
    problem = forced_problem(case.system, case.load(result.ratio), case.sweep)
    found = integrated(problem, point, case.load(result.ratio))
    known = found.harmonics[1] if found.settled else found.average
    check = Check(
        load_case=load_case,
        ratio=result.ratio,
        frequency_hz=point.omega / HZ,
        balance=float(accepted.amplitudes(output + 1)[output]),
        transient=float(np.abs(known[output])),
        settled=bool(found.settled),
        periods=int(found.periods),
        scatter=float(found.scatter),
        drifting=listed(found.drifting),
        order=point.order,
    )
    if abs(check.difference_percent) <= LARGE:
        return check
    order = MORE * max(case.sweep.high_harmonics[-1], point.order)
    many = refined(case, result.ratio, point, order)
    if many is None:
        return replace(check, refined_order=order)
    return replace(check, refined_order=order, refined=problem.amplitude(many, output))


def listed(names: Sequence[str]) -> str:
    """Return the first few of many names as text."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def integrated(
    problem: ForcedProblem, point: ForcedPoint, load: PeriodicLoad, periods: int = PATIENCE
) -> TransientResult:
    """Integrate in time from the balance's state at t = 0: near what is judged, so that little has to settle.

    Parameters
    ----------
    problem, point
        What was solved, and the solution.
    load
        Its loads.
    periods
        Give up settling after so many.
    """
    system = problem.system
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    traction = signals(problem, point).force[:, :2, 0]
    return integrate(
        system.plain_structure,
        system.interface.gap_operator,
        system.interface.laws,
        load,
        point.omega,
        system.outputs,
        start=start_from_harmonics(motion, point.omega, traction),
        stepping=TimeStepping(max_periods=periods),
    )


def refined(case: Case, ratio: float, point: ForcedPoint, order: int) -> ForcedPoint | None:
    """Solve the balance with `order` harmonics; None if it does not converge.

    Parameters
    ----------
    case, ratio
        The model and F_CL/F_HE.
    point
        A solution with fewer harmonics, where Newton begins.
    order
        Harmonics; the samples grow with them.
    """
    sweep = replace(case.sweep, high=order, samples=(MORE + 1) * case.sweep.samples)
    balance = forced_problem(case.system, case.load(ratio), sweep).high
    start = balance.unknowns(point.coefficients)
    solution = newton(lambda x: balance.linearise(x, point.omega), start, sweep.newton)
    if not solution.status.converged:
        return None
    return replace(point, coefficients=balance.coefficients(solution.x))
