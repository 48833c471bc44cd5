"""False and missed alarms of the strategies that verify, and how predicted and true errors go together.

``python -m evidence.strategies alarms`` solves the four cases, literature benchmark B6 and three sets of random systems with one harmonic, asks every
strategy about each solution, and holds what they say against the truth of `evidence.strategies.truth`. It writes ``docs/strategies_alarms.md``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evidence.models.lumped import blades_and_damper
from evidence.strategies.cases import CASES, HZ, SelectionCase
from evidence.strategies.random_systems import HELD_OUT, SYSTEMS, THIRD, random_two_blade_system
from evidence.strategies.truth import low_order_points, truths
from stickslip.arrays import FloatArray
from stickslip.harmonic.selection import strategy_named
from stickslip.harmonic.strategies import STRATEGIES
from stickslip.response.forced.problem import forced_problem

PAGE = Path(__file__).parents[2] / "docs" / "strategies_alarms.md"
THRESHOLD = 0.05
NAMES = ("jacobian_alert", "guarded_alert", "goal_oriented")
PUBLISHED = "jacobian_alert"
BAND = (5e-3, 5e-2)  # predicted errors that the seed's figure 7a finds on the diagonal
B6_FACTORS = (1.0, 1.5)
ROWS = 40  # most misses of a set that are listed


@dataclass(frozen=True)
class Row:
    """One converged solution with one harmonic: its true error, and what was said of it.

    Attributes
    ----------
    case
        Name.
    hertz
        Frequency.
    error
        Against the truth with twice the harmonics of the reference, a fraction; NaN where none was found.
    high_error
        Against the solution with the harmonics of the reference; NaN where it was not on the way to the truth.
    divided
        Whether solutions on both sides of the threshold were found.
    indicators
        Of the strategies by name, fractions.
    """

    case: str
    hertz: float
    error: float
    high_error: float
    divided: bool
    indicators: Mapping[str, float]


@dataclass(frozen=True)
class Source:
    """Points that are counted together, and how many frequencies had no solution with one harmonic."""

    title: str
    rows: tuple[Row, ...]
    lost: int

    @property
    def judged(self) -> list[Row]:
        """Return the points with a truth."""
        return [r for r in self.rows if np.isfinite(r.error)]


def _rows(case: SelectionCase) -> tuple[list[Row], int]:
    problem = forced_problem(case.system, case.load, case.sweep())
    points = low_order_points(case)
    names = [n for n in NAMES if n in STRATEGIES]
    rows = []
    for truth in truths(case, points):
        low = truth.low
        step = problem.step(problem.low, problem.low.unknowns(low.coefficients), low.omega)
        said = {n: strategy_named(n, THRESHOLD).judge(step).indicator for n in names}
        hertz = low.omega / HZ
        divided = truth.divided(THRESHOLD)
        rows.append(Row(case.name, hertz, truth.error, truth.high_error, divided, said))
    return rows, len(points) - len(rows)


def measured(title: str, cases: Iterable[SelectionCase]) -> Source:
    """Judge all points of some cases."""
    rows: list[Row] = []
    lost = 0
    for case in cases:
        more, without = _rows(case)
        rows += more
        lost += without
    return Source(title, tuple(rows), lost)


def _b6() -> Iterator[SelectionCase]:
    for factor in B6_FACTORS:
        yield SelectionCase(
            f"B6, factor {factor:g}",
            "literature benchmark B6",
            *blades_and_damper(excitation=factor),
            (HZ * 150, HZ * 235),
            86,
        )


def sources(systems: int = SYSTEMS) -> Iterator[Source]:
    """Yield the four cases, B6, and three sets of `systems` random ones."""
    for made in CASES.values():
        case = made()
        yield measured(case.title, [case])
    yield measured("literature benchmark B6, 150 to 235 Hz, factors 1 and 1.5", _b6())
    for first, what in ((0, "random systems"), (HELD_OUT, "held out"), (THIRD, "third set")):
        numbers = range(first, first + systems)
        title = f"{what} {first} to {first + systems - 1}"
        yield measured(title, (random_two_blade_system(n) for n in numbers))


def missed(rows: Iterable[Row], name: str) -> list[Row]:
    """Return the points whose error exceeds the threshold without an alarm."""
    return [r for r in rows if r.indicators[name] <= THRESHOLD < r.error]


def false(rows: Iterable[Row], name: str) -> list[Row]:
    """Return the points whose error is below the threshold in spite of an alarm."""
    return [r for r in rows if r.error <= THRESHOLD < r.indicators[name]]


def alarm_table(found: Sequence[Source], names: Sequence[str]) -> list[str]:
    """Return the lines of the table of missed and false alarms."""
    head = "| points | judged | silent | above 5 % | divided |"
    lines = [
        "| case |" + head[1:] + "".join(f" `{n}`: missed | false |" for n in names),
        "|---|" + "---:|" * (5 + 2 * len(names)),
    ]
    for source in found:
        rows = source.judged
        silent = sum(r.indicators[PUBLISHED] == 0.0 for r in rows)
        above = sum(r.error > THRESHOLD for r in rows)
        divided = sum(r.divided for r in rows)
        cells = [f"{len(source.rows)}", f"{len(rows)}", f"{silent}", f"{above}", f"{divided}"]
        for name in names:
            gone = missed(rows, name)
            of_reference = sum(r.high_error <= THRESHOLD for r in gone)
            note = f" ({of_reference})" if of_reference else ""
            wrong = len(false(rows, name))
            share = wrong / max(len(rows), 1)
            cells += [f"{len(gone)}{note}", f"{wrong} ({share:.1%})"]
        lines.append(f"| {source.title} | " + " | ".join(cells) + " |")
    return lines


def unjudged_line(found: Sequence[Source], names: Sequence[str]) -> str:
    """Return a sentence on the points without truth."""
    rows = [r for s in found for r in s.rows if not np.isfinite(r.error)]
    raised = ", ".join(f"`{n}` at {sum(not r.indicators[n] <= THRESHOLD for r in rows)}" for n in names)
    lost = sum(s.lost for s in found)
    return (
        f"No solution with twice the harmonics of the reference was found at {len(rows)} points, which are in no other count; "
        f"there an alarm was raised by {raised}. At {lost} frequencies there is none with one harmonic."
    )


def miss_table(found: Sequence[Source], names: Sequence[str]) -> list[str]:
    """Return the lines of the table of what the published rule misses."""
    lines = [
        "| system | Hz | true, % | against ñH, % |" + "".join(f" `{n}`, % |" for n in names),
        "|---|" + "---:|" * (3 + len(names)),
    ]
    for source in found:
        gone = sorted(missed(source.judged, PUBLISHED), key=lambda r: -r.error)
        lines += [_miss(r, names) for r in gone[:ROWS]]
        if len(gone) > ROWS:
            lines.append(f"| {len(gone) - ROWS} more of {source.title} |" + " |" * (3 + len(names)))
    return lines


def _miss(row: Row, names: Sequence[str]) -> str:
    values = [row.error, row.high_error, *(row.indicators[n] for n in names)]
    cells = ["–" if np.isnan(v) else "∞" if np.isinf(v) else f"{100 * v:.3g}" for v in values]
    return f"| {row.case} | {row.hertz:.2f} | " + " | ".join(cells) + " |"


@dataclass(frozen=True)
class Correlation:
    """How the logarithms of predicted and true errors go together in a band of predictions."""

    points: int
    slope: float
    median: float  # true over predicted
    scatter: float  # standard deviation of log10(true / predicted)
    within: float  # share of true errors within a factor of two of the predicted


def correlation(predicted: FloatArray, true: FloatArray) -> Correlation | None:
    """Return the correlation in the band; None for fewer than three points."""
    inside = (predicted >= BAND[0]) & (predicted <= BAND[1]) & (true > 0.0)
    if np.count_nonzero(inside) < 3:
        return None
    x, y = np.log10(predicted[inside]), np.log10(true[inside])
    slope = float(np.polyfit(x, y, 1)[0])
    off = y - x
    within = float(np.mean(np.abs(off) <= np.log10(2.0)))
    return Correlation(x.size, slope, float(10 ** np.median(off)), float(np.std(off)), within)


def correlation_table(found: Sequence[Source], names: Sequence[str]) -> list[str]:
    """Return the lines of the table of correlations."""
    lines = [
        "| case | strategy | points | slope | median of true / predicted | scatter, decades | within a factor of 2 |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    for source in found:
        rows = source.judged
        true = np.array([r.error for r in rows])
        for name in names:
            c = correlation(np.array([r.indicators[name] for r in rows]), true)
            if c is not None:
                lines.append(
                    f"| {source.title} | `{name}` | {c.points} | {c.slope:.2f} | {c.median:.2f} | {c.scatter:.2f} | {c.within:.0%} |"
                )
    return lines


def page(found: Sequence[Source]) -> str:
    """Return the part of the documentation."""
    names = [n for n in NAMES if n in STRATEGIES]
    return "\n".join(
        [
            "<!-- made by `python -m evidence.strategies alarms` -->",
            "### Missed and false alarms",
            "",
            (
                "Every converged solution with harmonics 0 and 1 is compared with the one with harmonics 0 to 10 near it. *Missed*: the true error "
                "exceeds 5 % and no alarm is raised (in brackets: how many of them are below 5 % against the reference, harmonics 0 to 5, so that "
                "only more harmonics than it has could tell). *False*: an alarm at a true error of at most 5 %, and its share of the judged points. "
                "*Silent*: nothing acts on the missing harmonics. *Divided*: solutions on both sides of 5 % exist; the nearer one counts."
            ),
            "",
            *alarm_table(found, names),
            "",
            unjudged_line(found, names),
            "",
            "### What the published rule misses",
            "",
            *miss_table(found, names),
            "",
            "### Predicted and true errors",
            "",
            f"Points whose predicted error lies between {BAND[0]:.1%} and {BAND[1]:.0%}; the slope is that of log true over log predicted.",
            "",
            *correlation_table(found, names),
            "",
        ]
    )


def run(systems: int = SYSTEMS, say: Callable[[str], None] = print) -> None:
    """Measure, print and write the page."""
    found = []
    for source in sources(systems):
        found.append(source)
        say(f"{source.title}: {len(source.rows)} points")
    text = page(found)
    PAGE.write_text(text, encoding="utf-8")
    say(text)
