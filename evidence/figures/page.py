"""The page that shows the pictures and the table."""

from collections.abc import Sequence

from evidence.figures.evidence import Evidence
from evidence.figures.solve import PATIENCE, STEPS
from evidence.figures.statements.responses import which
from evidence.figures.statements.statement import Statement, numbered, tally
from evidence.figures.timing import LEAST

HEAD = """# The figures of Gastaldi and Berruti

For readers of Gastaldi & Berruti {{cite}}`gastaldi2017`, who show the Jacobian Alert on two blades with a damper: which of their statements about their figures hold for an open case of the same kind?

- **{tally}, of {count} statements.**
- **Does not hold**: {failing}. The last column of the table says why.
- **Undecided**: {undecided}.
- **Figures 1 and 4 to 7** (first bending, {hertz[0]:g} to {hertz[1]:g} Hz) are tested on {first}.
- **Figures 9 to 11** ({mode}, {second_hertz[0]:g} to {second_hertz[1]:g} Hz) are tested on {second}.
- **Not tested**: figures 2, 3 and 8 are sketches and photographs; the measured curves of figures 9 and 10 belong to the paper's test rig.
- **What it does not show.** The paper leaves dimensions, masses and damping open. A search chose both cases so that they show part of its findings (`make pages NAME=reconstruction`, {{doc}}`second_damper`). A row that was a goal of this search shows that such a case exists; it is no test of the paper.

`make pages NAME=figures` draws the figures, judges the statements and writes this page.
"""
METHOD = """## How it is judged

*Holds* and *does not hold* compare the numbers of a row; the reason why a statement does not hold is computed, too. *Not tested*: the case lacks the subject of the statement, and the row says what is missing.
*Undecided*: the limit lies within the spread of the times, counts and times disagree, or the paper can be read in two ways that differ. A statement that the paper makes twice is one row. Errors in its own arithmetic are in {{doc}}`misprints`.

- **Cases.** Both are on the meshes of their studies. The alert is the published rule (`jacobian_alert`, threshold 5 %), not this package's default, and the harmonics of the repeats are the published five.
- **Time integration** is shooting with {steps} steps a period, begun at the balance with five harmonics, and plain integration where shooting fails. The paper compares with it at {paper:g}; here it is {in_time}. A motion is given up after {patience} periods there.
- **Costs** are counts, which are the same in every run, and CPU times of one core ({seconds:.0f} s for the whole command), medians of {repeats} interleaved repeats with their quartiles, at least {least:.0f} % to either side, since medians of whole runs differ by as much on a busy machine.
- **Other pages.** Numbers for two blades at the same ratio differ from page to page. Here times are those of {few} frequencies from {timing[0]:g} to {timing[1]:g} Hz and errors those of the amplitude at the peak against time integration; {{doc}}`theory/alert_cost` and {{doc}}`strategies` give theirs.
"""

CAPTIONS = (
    (
        "seed_fig1",
        (
            "Figure 1. Norms of the Jacobian's blocks between harmonics 0 to 5, in units in which a stuck contact is 1: a) full stick, static and dynamic part found together, and with sliders frozen where the static load leaves them, b) the accepted frequency with "
            "the largest predicted error, c) ΔJ, what one harmonic neglects, where the actual error is largest at the strong ratio."
        ),
    ),
    (
        "seed_fig4",
        (
            "Figure 4. Forced response with one and five harmonics and time integration (a), and what the alert chooses (b), at the ratio of time integration (above) and the weak one (below). "
            "Dotted vertical lines: frequencies that were not found."
        ),
    ),
    (
        "seed_fig5",
        "Figure 5. Rotation of the damper about the axial direction y, and hysteresis cycles at the middle contact points of the lines L1, L2 and R, next to the peak at the ratio of time integration.",
    ),
    (
        "seed_fig6",
        "Figure 6. Predicted and actual error against frequency: a) the paper's weak ratio, b) and c) the two that it names for its strong case.",
    ),
    (
        "seed_fig7",
        (
            "Figure 7. a) Actual against predicted error, with the diagonal and the 5 % lines; frequencies in full stick have no error and are left out. b) Error of the peak among equally spaced frequencies "
            "against the CPU time of the whole response, median and quartiles."
        ),
    ),
    (
        "seed_fig9",
        "Figure 9. Optimisation curves: amplitude for a unit of force and frequency of the peak against F_CL/F_HE, for the second damper (above) and the first (below).",
    ),
    ("seed_fig10", "Figure 10. Responses with the second damper."),
    (
        "seed_fig11",
        "Figure 11. Hysteresis cycles of the second damper at its resonance, at the middle contact points of L1, L2 and R.",
    ),
)


def page(evidence: Evidence, rows: Sequence[Statement], cases: tuple[str, str], seconds: float) -> str:
    """Return the page.

    Parameters
    ----------
    evidence, rows
        What was computed, and the table.
    cases
        The two cases in words.
    seconds
        CPU time of the command.
    """
    plan, second = evidence.plan, evidence.second_plan
    words = {
        "first": cases[0],
        "second": cases[1],
        "hertz": plan.hertz,
        "second_hertz": second.hertz,
        "mode": second.mode,
        "steps": STEPS,
        "patience": PATIENCE,
        "seconds": seconds,
        "repeats": plan.repeats,
        "least": 100 * LEAST,
        "few": plan.timing_frequencies,
        "timing": plan.timing_hertz,
        "paper": plan.time_ratios[0],
        "in_time": which(evidence),
        "tally": tally(rows),
        "count": len(rows),
        "failing": _named(rows, "does not hold"),
        "undecided": _named(rows, "undecided"),
    }
    parts = [HEAD.format(**words), "## Statements\n", table(rows), METHOD.format(**words), "## Figures\n"]
    parts += [f"![{text.split('.')[0]}](images/{name}.png)\n\n{text}\n" for name, text in CAPTIONS]
    parts += ["## What was not found\n", lost(evidence)]
    return "\n".join(parts)


def table(rows: Sequence[Statement]) -> str:
    """Return the rows as a Markdown table."""
    lines = ["| | where | the paper says | its number | here | verdict | why |", "|---|---|---|---|---|---|---|"]
    for name, row in numbered(rows):
        verdict = row.said if row.verdict == "holds" else f"**{row.said}**"
        why = row.why if row.verdict == "does not hold" else ""
        cells = (name, row.place, row.claim, row.number, row.own, verdict, why)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _named(rows: Sequence[Statement], verdict: str) -> str:
    """Return the numbers of the statements with a verdict."""
    return ", ".join(name for name, row in numbered(rows) if row.verdict == verdict) or "none"


def lost(evidence: Evidence) -> str:
    """Return the frequencies that were not found, and motions in time that are not periodic."""
    lines = []
    for peaks in [*evidence.peaks, *evidence.second_peaks]:
        which = "second damper, " if peaks in evidence.second_peaks else ""
        for name, text in (("low", "one harmonic"), ("high", "five harmonics"), ("alert", "alert")):
            hertz = getattr(peaks, name).lost
            if hertz:
                lines.append(
                    f"- {which}ratio {peaks.ratio:g}, {text}, along the branch: {len(hertz)} points between {min(hertz):.2f} and {max(hertz):.2f} Hz"
                )
    lines += [
        f"- ratio {ratio:g}, equally spaced frequencies, one or five harmonics: {', '.join(f'{f:.2f}' for f in hertz)} Hz"
        for ratio, hertz in evidence.unsolved.items()
        if hertz
    ]
    for timing in evidence.timing:
        loose = [o for o in timing.orbits if not o.found]
        lines += [f"- ratio {timing.ratio:g}, time integration at {o.hertz:.2f} Hz: {o.motion}" for o in loose]
    unstable = sum(o.motion == "unstable" for t in evidence.timing for o in t.orbits)
    lines.append(
        f"- motions in time that are periodic but unstable, among those of figure 7b: {unstable} of {sum(len(t.orbits) for t in evidence.timing)}"
    )
    return "\n".join(lines) + "\n"
