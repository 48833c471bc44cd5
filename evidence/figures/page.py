"""The page that shows the pictures and the table."""

from collections.abc import Sequence

from evidence.figures.evidence import Evidence
from evidence.figures.statements import Statement

HEAD = """# The figures of Gastaldi and Berruti

Gastaldi & Berruti {{cite}}`gastaldi2017` show the Jacobian Alert on two blades with a damper. `make figures` draws the counterparts of their figures for this
package's own two blades and compares every statement that they make about them with what comes out. The numbers on this page, and
the verdicts, are written by that command; where a statement does not hold, that is a result, and a sentence says what is known of the reason.

The blades and the damper are those of the example study, **on a mesh with elements twice as large** (as in {{doc}}`validation`; a reduced model is
compared with itself here, not one mesh with another). The second damper, for figures 10 and 11, has other angles and contact lines: {glued}. The alert is the
published rule (`jacobian_alert`, threshold 5 %), not this package's default. Time integration is shooting with {steps} steps a period, begun at the balance with five
harmonics; where it finds no periodic motion, the motion is integrated for {patience} periods and averaged, and its marker is hollow. Times are CPU times of one core, all in one
process ({seconds:.0f} s for the whole command), and differ from run to run.

Numbers for the same two blades at the same ratio differ from page to page: here times are those of 20 frequencies from 160.25 to 184 Hz and
errors those of the amplitude at the peak against time integration; {{doc}}`theory/alert_cost` times 20 frequencies from 165 to 184 Hz on the example's own
mesh, {{doc}}`strategies` 49 frequencies from 160 to 184 Hz with errors, phases included, against harmonics 0 to 10; {{doc}}`theory/shooting` has the error of
five harmonics at the peak with its phase, {{doc}}`theory/transient` the amplitudes on the example's own mesh.

**{holding} of {judged} statements hold here.** Figures 2, 3 and 8 of the paper are sketches and photographs; the measured curves of its figures 9 and 10 belong to its test rig.
"""

CAPTIONS = (
    (
        "seed_fig1",
        (
            "Figure 1. Norms of the Jacobian's blocks between harmonics 0 to 5, in units in which a stuck contact is 1: a) full stick, b) the accepted frequency with "
            "the largest predicted error, c) ΔJ, what one harmonic neglects, where the actual error is largest at the strong ratio."
        ),
    ),
    (
        "seed_fig4",
        (
            "Figure 4. Forced response with one and five harmonics and time integration (a), and what the alert chooses (b), at the strong ratio (above) and a weak one (below). "
            "Dotted vertical lines: frequencies that were not found."
        ),
    ),
    (
        "seed_fig5",
        "Figure 5. Rotation of the damper about the axial direction y, and hysteresis cycles at the middle contact points of the lines L1, L2 and R, at the resonance of the strong ratio.",
    ),
    (
        "seed_fig6",
        "Figure 6. Predicted and actual error against frequency: a) a weak case of this damper, b) the ratio of the paper's weak case, c) the strong case.",
    ),
    (
        "seed_fig7",
        (
            "Figure 7. a) Actual against predicted error, with the diagonal and the 5 % lines; frequencies in full stick have no error and are left out. b) Error of the peak among equally spaced frequencies "
            "against the CPU time of the whole response."
        ),
    ),
    (
        "seed_fig9",
        "Figure 9. Optimisation curves: amplitude for a unit of force and frequency of the peak against F_CL/F_HE, for the first damper.",
    ),
    ("seed_fig10", "Figure 10. Responses with the second damper."),
    (
        "seed_fig11",
        "Figure 11. Hysteresis cycles of the second damper at its resonance, at the middle contact points of L1, L2 and R.",
    ),
)


def page(
    evidence: Evidence, rows: Sequence[Statement], glued: str, settings: tuple[int, int, float]
) -> str:
    """Return the page.

    Parameters
    ----------
    evidence, rows
        What was computed, and the table.
    glued
        Description of the second damper.
    settings
        Steps a period and patience of the time integration, and CPU seconds of the command.
    """
    steps, patience, seconds = settings
    judged = [row for row in rows if row.holds is not None]
    parts = [
        HEAD.format(
            glued=glued, steps=steps, patience=patience, seconds=seconds,
            holding=sum(bool(row.holds) for row in judged), judged=len(judged),
        ),
        "## Statements\n",
        table(rows),
        "## Figures\n",
    ]  # fmt: skip
    parts += [f"![{text.split('.')[0]}](images/{name}.png)\n\n{text}\n" for name, text in CAPTIONS]
    parts += ["## What was not found\n", lost(evidence)]
    return "\n".join(parts)


def table(rows: Sequence[Statement]) -> str:
    """Return the rows as a Markdown table."""
    lines = [
        "| where | the paper says | its number | here | verdict | why |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        verdict = row.verdict if row.holds else f"**{row.verdict}**"
        why = "" if row.holds else row.why
        cells = (row.place, row.claim, row.number, row.own, verdict, why)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def lost(evidence: Evidence) -> str:
    """Return the frequencies that were not found, and motions in time that are not periodic."""
    lines = []
    for peaks in [*evidence.peaks, *evidence.glued]:
        which = "second damper, " if peaks in evidence.glued else ""
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
        lines += [
            f"- ratio {timing.ratio:g}, time integration at {o.hertz:.2f} Hz: {o.motion}"
            for o in loose
        ]
    unstable = sum(o.motion == "unstable" for t in evidence.timing for o in t.orbits)
    lines.append(
        f"- motions in time that are periodic but unstable, among those of figure 7b: {unstable} of {sum(len(t.orbits) for t in evidence.timing)}"
    )
    return "\n".join(lines) + "\n"
