"""The page of the documentation on all strategies."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from evidence.strategies.compare import FEW, FLOOR, MANY, THRESHOLD, Comparison

DOCS = Path(__file__).parents[2] / "docs"
PAGE = DOCS / "strategies.md"
ALARMS = DOCS / "strategies_alarms.md"
SMALLEST = 1e-5  # error below which digits are those of the solver

BEFORE = """# All strategies on the same cases

This page compares all ways of choosing harmonics on the same four cases. Read it to choose `selection`. It is made by `make pages NAME=strategies`, in one process. Every strategy goes through the same equally spaced frequencies, with harmonics 0 and 1 at the least and 0 to 5 at the most, and with its default parameters:

* `jacobian_alert` is the rule as published, in both passages ({doc}`theory/selection`).
* `guarded_alert` ({doc}`theory/guarded_alert`) and `goal_oriented` ({doc}`theory/goal_oriented`) verify as it does.
* The other six predict the harmonics of the next frequency or raise them step by step ({doc}`theory/rivals`).
* `always_low` and `always_high` choose nothing.

An accepted solution is compared with the solution with harmonics 0 to 10, followed as a branch. If it is more than 5 % away from that, it is also compared with the solution that Newton's method finds from it with as many harmonics, and the smaller error counts. Errors are those of the first harmonic over all outputs (eq. 29 of {cite:t}`gastaldi2017`).

Each strategy is timed once through the 49 frequencies of the two-blade cases, on the coarse mesh of `evidence/models/two_blades.toml` (elements twice as large). Other pages have other numbers for the same blades at the same ratio. {doc}`theory/alert_cost` times 20 frequencies from 165 to 184 Hz on the mesh of that study. {doc}`seed_figures` has the blades of today's `examples/two_blades`. {doc}`theory/shooting` has errors in amplitude and phase against time integration; here they are against harmonics 0 to 10, in amplitude and phase.

* *Unknowns*: harmonic-unknowns solved, retained coordinates times real coefficients, summed over all solves, repeats and failures included. *Newton* and *CPU*: iterations and processor time. All three relative to `always_high`.
* *At resonance*: error at the frequency where the judge has its largest amplitude; *largest*: over all frequencies.
* *Missed*: accepted solutions with an error above 5 %. *False*: accepted solutions with more harmonics than 0 and 1 although these two would have been within 5 %. For `always_high` that is the number of frequencies at which more are wasted.
* *Not found*: frequencies without an accepted solution. *Changes*: how often the harmonics change from one frequency to the next.
"""


CAPTION = (
    "*Error at resonance against harmonic-unknowns solved (above) and CPU time (below), both relative to all harmonics everywhere. "
    f"The line is the threshold of 5 %; errors below {100 * FLOOR:g} % are drawn there.*"
)


def percent(value: float) -> str:
    """Return a fraction in per cent with three digits; – where there is none."""
    if not np.isfinite(value):
        return "–"
    return f"{100 * value:.3g} %" if value >= SMALLEST else f"< {100 * SMALLEST:g} %"


def table(comparison: Comparison) -> list[str]:
    """Return the lines of a case's table."""
    many = comparison.of(MANY)
    lines = [
        "| strategy | unknowns | Newton | CPU | at resonance | largest | missed | false | not found | changes |",
        "|---|" + "---:|" * 9,
    ]
    for o in comparison.outcomes:
        cells = [
            f"`{o.entry.selection}`" + o.entry.title.removeprefix(o.entry.selection),
            f"{100 * o.unknowns / many.unknowns:.0f} %",
            f"{100 * o.iterations / many.iterations:.0f} %",
            f"{100 * o.seconds / many.seconds:.0f} %",
            percent(o.at_peak),
            percent(o.largest),
            *(str(n) for n in (o.missed, o.false, o.lost, o.turns)),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def heading(comparison: Comparison) -> list[str]:
    """Return what is said of a case before its table."""
    case = comparison.case
    few = comparison.of(FEW)
    title = case.title[0].upper() + case.title[1:]
    n = case.system.retained.size
    text = f"{case.frequencies} frequencies, {n} retained coordinates; one harmonic is more than {100 * THRESHOLD:g} % off at {few.missed} of them."
    if comparison.unjudged:
        text += f" At {comparison.unjudged} frequencies the judge found no solution; they are in no count of errors."
    return [f"## {title}", "", text, ""]


def page(found: Sequence[Comparison], after: str) -> str:
    """Return the page: frame, figure, a table for each case, what it says, and the alarms where they were counted."""
    lines = [
        "<!-- made by `make pages NAME=strategies`; the text stands in evidence/strategies/page.py and evidence/strategies/findings.md -->",
        BEFORE,
        "![error at resonance against harmonic-unknowns and CPU time](images/strategies.png)",
        "",
        CAPTION,
        "",
    ]
    for comparison in found:
        lines += [*heading(comparison), *table(comparison), ""]
    lines += [after.rstrip(), ""]
    if ALARMS.exists():
        lines += ["## Alarms counted one by one", "", f"```{{include}} {ALARMS.name}\n```", ""]
    return "\n".join(lines)


def write(found: Sequence[Comparison]) -> None:
    """Write the page."""
    after = (Path(__file__).parent / "findings.md").read_text(encoding="utf-8")
    PAGE.write_text(page(found, after), encoding="utf-8")
