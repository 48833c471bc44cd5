"""The numbers of the page on contact points: tables and the sentences that hold numbers."""

from pathlib import Path

import numpy as np

from evidence.sections.cases import EXAMPLE, LINES, MOST, SECTIONS, UNEVEN, Found, Peak, Series
from evidence.sections.model import example, points_of_example

NUMBERS = Path(__file__).parents[2] / "docs" / "contact_points_numbers.md"
FEW = EXAMPLE
HEIGHT, PLACE = (0.01, 0.001)  # of amplitude and of frequency, from which on a change is called significant


def write(found: Found, path: Path = NUMBERS) -> None:
    """Write what the page takes in."""
    made = "<!-- made by `make pages NAME=sections`; the text stands in evidence/sections/page.py -->"
    parts = [made, _setting(), _table(found), *_said(found), _of_lines(found), _of_sharing(found)]
    path.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def percent(fraction: float) -> str:
    """Return a difference in per cent, with its sign."""
    size = 100 * fraction
    return f"{size:+.3f} %" if abs(size) < 1 else f"{size:+.1f} %"


def pair(off: tuple[float, float]) -> str:
    """Return differences of amplitude and frequency."""
    return f"{percent(off[0])}, {percent(off[1])}"


def against(peak: Peak, best: Peak) -> str:
    """Return differences of amplitude and frequency from another peak."""
    return pair((peak.metres / best.metres - 1, peak.hertz / best.hertz - 1))


def _heading(series: Series) -> str:
    return f"{series.case.name}, ratio {series.ratio:g}, $H$ = {series.kept}"


def _setting() -> str:
    study, patch = example()
    points = points_of_example()
    areas = {side: 1e6 * area for side, area in patch.areas.items()}
    size = study.tables.part["blades"].platform_size_m  # type: ignore[attr-defined]
    return (
        f"The model is the blades and the damper of the shipped example. The damper's sides have {points['flat']} and {points['curved']} points. They touch over the depth of the "
        f"platforms, {1e3 * patch.length:g} mm; the flat one from its first line to its last, {1e3 * patch.flat[0]:g} to {1e3 * patch.flat[1]:g} mm from the apex "
        f"({areas['flat']:.4g} mm²). The curved one is given a strip of {areas['curved'] / (1e3 * patch.length):g} mm. The stiffness per area is that of the example's whole side over "
        "this area. Sections stand in the middles of equal strips. One mesh serves all: points meet facets (`node_to_segment`), elements of the platforms are the "
        f"example's ({1e3 * size:g} mm), those of airfoils and feet twice as large."
    )


def _table(found: Found) -> str:
    """Return the table of all series."""
    head = ["sections", *(_heading(s) for s in found.series)]
    rows = [head, ["---:"] * len(head)]
    rows += [[str(count), *(_cell(s, count) for s in found.series)] for count in SECTIONS]
    rows.append(["order", *(", ".join(_order(s, which) for which in (0, 1)) for s in found.series)])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + (
        f"\n\n*Amplitude and frequency of the peak, as differences from {MOST} sections, whose own values stand in their row. Order: the p with which "
        f"differences between {FEW} and {MOST} sections are like $n^{{-p}} - {MOST}^{{-p}}$, in amplitude and frequency; – if they are not. Bending: output `tip1.x`. Leaning: the same, with the centre of mass, where the pull acts, a sixth of "
        f"the length off the middle. Torsion: force and output at the edge of a tip, `edge1.x`. {_lost(found)}*"
    )


def _lost(found: Found) -> str:
    """Say how many points of the sweeps were not found."""
    lost = [f"{p.lost} with {p.count} ({_heading(s)})" for s in found.series for p in s.peaks if p.lost]
    return f"Points of the sweeps without a solution: {'; '.join(lost) or 'none'}."


def _cell(series: Series, count: int) -> str:
    if count not in series.counts:
        return ""
    return pair(series.off(count)) if count < MOST else _whole(series.of(count))


def _order(series: Series, which: int) -> str:
    order = np.nan if series.kept == "auto" else series.order(which)
    return f"{order:.1f}" if np.isfinite(order) else "–"


def _whole(peak: Peak) -> str:
    return f"{1e6 * peak.metres:.2f} µm, {peak.hertz:.3f} Hz"


def significant(off: tuple[float, float]) -> bool:
    """Whether amplitude or frequency change by more than is let pass."""
    return abs(off[0]) > HEIGHT or abs(off[1]) > PLACE


def _needed(series: Series) -> str:
    """Return the least number of sections from which on no number changes the peak significantly."""
    enough = MOST
    for count in reversed(series.counts):
        if significant(series.off(count)):
            break
        enough = count
    if enough == MOST:
        return f"more than {series.counts[-2]}"
    return f"{enough} section{'s' if enough > 1 else ''}"


def _said(found: Found) -> list[str]:
    """Return what the table says."""
    bending = [s for s in found.series if s.case.name == "bending"]
    offs = [s.off(FEW) for s in bending]
    height, place = (max(abs(off[i]) for off in offs) for i in (0, 1))
    changed = [s for s, off in zip(bending, offs, strict=True) if significant(off)]
    verdict = "holds in all of them" if not changed else f"does not hold at {'; '.join(_heading(s) for s in changed)}"
    limits = f"{100 * HEIGHT:g} % of the amplitude or {100 * PLACE:g} % of the frequency"
    first = (
        f"**Bending.** Between {FEW} and {MOST} sections the peak changes by at most {100 * height:.2g} % in amplitude and {100 * place:.2g} % in frequency, over both "
        f"ratios and both choices of harmonics. With a change of {limits} called significant, the paper's statement that there is none {verdict}. "
        f"Harmonics by need went up to {' and up to '.join(f'{max(p.highest for p in s.peaks)} at ratio {s.ratio:g}' for s in bending if s.kept == 'auto')}."
    )
    rows = [
        f"* {_heading(s)}: {_needed(s)}; with {FEW} of them {pair(s.off(FEW))}, with one {pair(s.off(1))}."
        for s in found.series
    ]
    second = "\n".join(
        [
            "**How many it takes** until none of the larger numbers that were solved changes the peak significantly:",
            "",
            *rows,
        ]
    )
    return [first, second]


def _of_lines(found: Found) -> str:
    rows = [["lines of the flat side", *(f"ratio {s.ratio:g}" for s in found.lines)]]
    rows.append(["---:"] * len(rows[0]))
    for count in LINES:
        cells = [pair(s.off(count)) if count < LINES[-1] else _whole(s.of(count)) for s in found.lines]
        rows.append([str(count), *cells])
    own = [against(found.get("bending", s.ratio).of(FEW), s.peaks[-1]) for s in found.lines]
    rows.append(["the example's 2", *own])
    table = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    return (
        f"**Lines.** The same area of the flat side on more lines, {FEW} sections, bending, five harmonics; differences from {LINES[-1]} lines, which stand in the middles of equal strips. The example's "
        f"two lines stand at the ends of the same area:\n\n{table}\n\nAt rest the resultant of the example's flat side acts {1e3 * found.resultant:.1f} mm from the apex, and a side that only pushes carries "
        "a load between its outer lines alone. They stand at "
        + "; ".join(_outer(n) for n in LINES)
        + f". {_between(found.resultant)} Pressed evenly, two lines in the middles of halves would make the side $1 - 1/2^2$ = 3/4 as "
        "stiff against rocking as the area is, two at its ends three times as stiff. So lines of the flat side are more than a matter of resolution: two at the ends mean that "
        "the flat touches at its edges."
    )


def _between(resultant: float) -> str:
    """Say for which numbers of lines the resultant lies between the outer ones."""
    ends = {n: (example()[1].lines(n)[0], example()[1].lines(n)[-1]) for n in LINES}
    out = [str(n) for n, (low, high) in ends.items() if not low <= resultant <= high]
    if not out:
        return "The resultant is between them with all of these numbers."
    return f"With {' and '.join(out)} the resultant is not between them: the damper tips and lets the blades go."


def _outer(count: int) -> str:
    lines = example()[1].lines(count)
    return f"{1e3 * lines[0]:.1f} and {1e3 * lines[-1]:.1f} mm with {count}"


def _of_sharing(found: Found) -> str:
    counts = [p.count for p in found.per_point.peaks]
    best, area, share = found.strong.of(MOST), *found.uneven

    cells = [[str(n) for n in counts], [against(p, best) for p in found.per_point.peaks]]
    table = [
        "| sections | " + " | ".join(cells[0]) + " |",
        "|---|" + "---:|" * len(counts),
        "| per point | " + " | ".join(cells[1]) + " |",
        "| per area | " + " | ".join(against(found.strong.of(n), best) for n in counts) + " |",
    ]
    last = found.per_point.peaks
    step = abs(last[-1].hertz - last[-2].hertz), abs(best.hertz - found.strong.of(counts[-2]).hertz)
    return (
        f"**Stiffness per point** does not converge: with the example's {FEW} sections it is that of the side; with $n$ it is $n$/{FEW} of it. "
        f"{_heading(found.strong)}, against {MOST} sections per area:\n\n"
        + "\n".join(table)
        + f"\n\nFrom {counts[-2]} to {counts[-1]} sections the peak still moves by {1e3 * step[0]:.1f} mHz per point and by {1e3 * step[1]:.1f} mHz per area.\n\n"
        f"**Unequal distances.** {UNEVEN} sections that crowd at one end, the $k$-th at $((k + 1/2)/{UNEVEN})^2$ of the length: {against(area, best)} with tributary areas, {against(share, best)} with equal shares."
    )
