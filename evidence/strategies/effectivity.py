"""How sharp the estimates of the goal-oriented strategy are, and what its choice of harmonics saves.

Run ``python -m evidence.strategies.effectivity [NAME ...] [--systems N]``. Every converged solution with one harmonic is held against the truth of
`evidence.strategies.truth`, with twice the harmonics of the reference. The effectivity of an estimate is the estimate over the true error. It is
taken at *weakly nonlinear* points: true error of 0.05 to 5 %, and no contact that slips in the one solution but never in the other, or lifts off
in the one but never in the other. Alarms are counted at all points. Then each strategy's repeats are solved, each from the start that the
strategy gives, judged again and repeated again as in the single passage, and held against the same truth.
"""

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from time import process_time

import numpy as np

from evidence.models.lumped import blades_and_damper
from evidence.strategies.cases import CASES, HZ, SelectionCase
from evidence.strategies.random_systems import HELD_OUT, random_two_blade_system
from evidence.strategies.truth import Truth, judging_problem, low_order_points, truths
from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.selection import strategy_named
from stickslip.harmonic.selection.adjoint import estimate, outputs_of
from stickslip.harmonic.strategies import STRATEGIES
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.solve.newton_method import Newton, newton

THRESHOLD = 0.05
WEAK = (5e-4, 5e-2)  # true errors of weakly nonlinear points
SHARP = (0.5, 2.0)  # effectivity index that is asked for
B6_FACTORS = (0.5, 1.0, 1.5, 3.0)
LARGE = 20  # retained coordinates above which every fourth frequency will do
NEWTON = Newton(max_iterations=40)
KINDS = ("alert", "estimate", "bound")
COMPARED = ("jacobian_alert", "guarded_alert", "goal_oriented")


@dataclass(frozen=True)
class Row:
    """One point: true relative error, what was said of it, and whether it is weakly nonlinear."""

    true: float
    alert: float
    estimate: float
    bound: float
    weak: bool


@dataclass(frozen=True)
class Cost:
    """The repeats of one strategy: points, further repeats of them, rows of harmonics solved, Newton steps, CPU seconds, errors left."""

    repeats: int
    again: int
    rows: int
    iterations: int
    judging: float
    solving: float
    errors: tuple[float, ...]
    lost: int


def b6(factor: float) -> Iterable[SelectionCase]:
    """Literature benchmark B6 from 150 to 235 Hz with its excitation times a factor."""
    title = f"B6, excitation times {factor:g}"
    yield SelectionCase(f"b6_{factor:g}", title, *blades_and_damper(excitation=factor), (HZ * 150, HZ * 235), 171)


def thinned(case: SelectionCase) -> SelectionCase:
    """Return a large case with few of its frequencies: the truth has 21 unknowns a coordinate."""
    large = case.system.retained.size > LARGE
    return replace(case, frequencies=(case.frequencies - 1) // 4 + 1) if large else case


def sources(systems: int) -> dict[str, Callable[[], Iterable[SelectionCase]]]:
    """Return the groups of cases whose points are counted together."""
    found: dict[str, Callable[[], Iterable[SelectionCase]]] = {f"b6_{f:g}": lambda f=f: b6(f) for f in B6_FACTORS}
    found |= {name: lambda made=made: [thinned(made())] for name, made in CASES.items()}
    for name, first in (("random", 0), ("random_held_out", HELD_OUT)):
        numbers = range(first, first + systems)
        found[name] = lambda numbers=numbers: (random_two_blade_system(i) for i in numbers)
    return found


def weakly_nonlinear(problem: ForcedProblem, truth: Truth) -> bool:
    """Whether the true error is small and every contact slips and lifts off at some time in both solutions or in neither."""
    if truth.reference is None or not WEAK[0] <= truth.error <= WEAK[1]:
        return False
    seen = []
    for point in (truth.low, truth.reference):
        balance = problem.high.with_harmonics(point.support)
        state = balance.contacts(balance.unknowns(point.coefficients), point.omega).state
        seen.append([np.any(state == kind, axis=-1) for kind in (1, 2)])
    return bool(np.array_equal(seen[0], seen[1]))


def judged(problem: ForcedProblem, truth: Truth) -> Row:
    """Estimate the error of one point."""
    point, low = truth.low, problem.low
    outputs = outputs_of(problem.measure, low.linear.recover(point.omega, point.coefficients))
    x = low.unknowns(point.coefficients)
    found = estimate(low, problem.high, x, point.omega, outputs, problem.alert_solve)
    alert = float(np.max(np.abs(found.changes[0]), initial=0.0))
    weak = weakly_nonlinear(problem, truth)
    return Row(truth.error, alert, found.error, found.bound, weak)


def repeats(problem: ForcedProblem, judge: ForcedProblem, name: str, found: Sequence[Truth]) -> Cost:
    """Judge all points by a strategy and solve again what it asks for, until it asks for no more."""
    strategy = strategy_named(name, THRESHOLD)
    count = again = rows = iterations = lost = 0
    judging = solving = 0.0
    errors = []
    for truth in found:
        own, reference = truth.low, truth.reference
        if reference is None:
            continue
        harmonics, asked = own.support, 0
        while True:
            few = problem.balance(harmonics)
            step = problem.step(few, few.unknowns(own.coefficients), own.omega)
            began = process_time()
            verdict = strategy.judge(step)
            judging += process_time() - began
            wanted = tuple(sorted({*harmonics, *(verdict.again or ())}))
            if wanted == harmonics:
                break
            balance = problem.balance(wanted)
            start = own.coefficients if verdict.start is None else verdict.start
            began = process_time()
            solution = newton(lambda v, b=balance, w=own.omega: b.linearise(v, w), balance.unknowns(start), NEWTON)
            solving += process_time() - began
            asked, rows = asked + 1, rows + balance.n_rows
            iterations += solution.iterations
            if not solution.status.converged:
                lost += 1
                break
            own, harmonics = _point(balance, own, solution.x), wanted
        count += asked > 0
        again += max(asked - 1, 0)
        if asked and own is not truth.low:
            errors.append(judge.real_error(own, reference))
    return Cost(count, again, rows, iterations, judging, solving, tuple(errors), lost)


def _point(balance: HarmonicBalance, point: ForcedPoint, x: FloatArray) -> ForcedPoint:
    harmonics = np.array(balance.harmonics)
    return replace(point, coefficients=balance.coefficients(x), harmonics=harmonics)


def table(rows: Sequence[Row]) -> list[str]:
    """Return the effectivities and the alarms of the estimates."""
    weak = [r for r in rows if r.weak]
    lines = [
        f"  {len(rows)} points, {len(weak)} weakly nonlinear, {sum(r.true > THRESHOLD for r in rows)} with true errors above 5 %"
    ]
    for kind in KINDS:
        values = np.array([getattr(r, kind) for r in rows])
        true = np.array([r.true for r in rows])
        missed = int(np.sum((true > THRESHOLD) & (values <= THRESHOLD)))
        false = int(np.sum((true <= THRESHOLD) & (values > THRESHOLD)))
        line = f"  {kind:9s}"
        if weak:
            index = np.array([getattr(r, kind) / r.true for r in weak])
            low, median, high = np.percentile(index, [5, 50, 95])
            inside = np.mean((index >= SHARP[0]) & (index <= SHARP[1]))
            line += f" effectivity min {index.min():.2f}, 5 % {low:.2f}, median {median:.2f}, 95 % {high:.2f}, max {index.max():.2f}, in 0.5 to 2: {inside:.1%};"
        lines.append(f"{line} missed {missed}, false {false}")
    return lines


def cost_line(name: str, cost: Cost) -> str:
    """Return what the repeats of a strategy cost and what errors they leave."""
    line = f"  {name:15s} {cost.repeats} repeats"
    if not cost.repeats:
        return f"{line}, judging {cost.judging:.2f} s"
    left = np.array(cost.errors)
    spread = ", ".join(f"{100 * v:.3g}" for v in np.percentile(left, [50, 95, 100])) if left.size else "none"
    return (
        f"{line} ({cost.again} more of the same points), {cost.rows / cost.repeats:.2f} rows a point, {cost.iterations} Newton steps, judging {cost.judging:.2f} s, "
        f"solving {cost.solving:.2f} s, errors left (50, 95, 100 %): {spread} %, {int(np.sum(left > THRESHOLD))} above 5 %, {cost.lost} not found"
    )


def _sum(costs: Sequence[Cost]) -> Cost:
    return Cost(
        sum(c.repeats for c in costs),
        sum(c.again for c in costs),
        sum(c.rows for c in costs),
        sum(c.iterations for c in costs),
        sum(c.judging for c in costs),
        sum(c.solving for c in costs),
        tuple(e for c in costs for e in c.errors),
        sum(c.lost for c in costs),
    )


def measured(cases: Iterable[SelectionCase]) -> tuple[list[Row], dict[str, Cost]]:
    """Go through the cases of one source."""
    names = [name for name in COMPARED if name in STRATEGIES]
    rows: list[Row] = []
    costs: dict[str, list[Cost]] = {name: [] for name in names}
    for case in cases:
        problem = forced_problem(case.system, case.load, case.sweep())
        found = [t for t in truths(case, low_order_points(case)) if t.reference is not None]
        rows += [judged(problem, t) for t in found]
        for name in names:
            costs[name].append(repeats(problem, judging_problem(case), name, found))
    return rows, {name: _sum(each) for name, each in costs.items()}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m evidence.strategies.effectivity", description=__doc__)
    parser.add_argument("--systems", type=int, default=50, help="random systems of each set")
    parser.add_argument("names", nargs="*", help="sources; all by default")
    given = parser.parse_args()
    known = sources(given.systems)
    unknown = sorted(set(given.names) - set(known))
    if unknown:
        parser.error(f"no source {', '.join(unknown)}; there are {', '.join(known)}")
    for name in given.names or known:
        rows, costs = measured(known[name]())
        print(name, *table(rows), *(cost_line(n, c) for n, c in costs.items()), sep="\n", flush=True)


if __name__ == "__main__":
    main()
