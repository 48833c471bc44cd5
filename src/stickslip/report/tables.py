"""Tables of the page, as HTML."""

from collections.abc import Sequence
from html import escape

import numpy as np

from stickslip.report.figures_response import peak_hz, peak_response
from stickslip.report.quantities import NONE, fixed, number, percent, predicted, quantity, scale_for
from stickslip.report.result import RATIO, Result


def html_table(head: Sequence[str], rows: Sequence[Sequence[str]], *, numeric: bool = True) -> str:
    """Return a table; the cells are HTML already, and set flush right from the second column if numeric."""
    kind = ' class="numeric"' if numeric else ""
    top = "".join(f'<th scope="col">{cell}</th>' for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    top = f"<thead><tr>{top}</tr></thead>" if head else ""
    return f'<div class="wide"><table{kind}>{top}<tbody>{body}</tbody></table></div>'


def _reduction_rows(result: Result, full: str, reduced: str, name: str) -> list[list[str]]:
    if not result.has(full, reduced):
        return []
    a, b = result.floats(full), result.floats(reduced)
    return [
        [
            f"{name} {k + 1}",
            fixed(x, 3),
            fixed(y, 3),
            percent(100 * (y / x - 1) if x else float("nan")),
        ]
        for k, (x, y) in enumerate(zip(a, b, strict=True))
    ]


def reduction(result: Result) -> str:
    """Frequencies of the full against the reduced model."""
    rows = _reduction_rows(result, "frequency_full_hz", "frequency_reduced_hz", "free")
    rows += _reduction_rows(
        result, "frequency_stuck_full_hz", "frequency_stuck_reduced_hz", "stuck"
    )
    if not rows:
        return "<p>The reduction was not checked in this run.</p>"
    differences = [
        np.abs(result.floats(b) / result.floats(a) - 1)
        for a, b in (
            ("frequency_full_hz", "frequency_reduced_hz"),
            ("frequency_stuck_full_hz", "frequency_stuck_reduced_hz"),
        )
        if result.has(a, b)
    ]
    finite = np.concatenate(differences)
    finite = finite[np.isfinite(finite)]
    worst = percent(100 * float(finite.max())) if finite.size else NONE
    text = f"<p>The reduced model reproduces the frequencies of the full one within {worst}.</p>"
    return text + html_table(["mode", "full (Hz)", "reduced (Hz)", "difference"], rows)


def _optional(result: Result, name: str, index: int) -> float:
    return float(result.floats(name)[index]) if name in result.data else float("nan")


def load_cases(result: Result) -> str:
    """One row a load case: peak, points, work."""
    scale = scale_for(np.array([peak_response(result, c) for c in result.cases]), "m/N")
    head = [
        RATIO, "excitation", "peak", f"peak / force ({scale.unit})", "at (Hz)", "points", f"with H = {result.low_name}",
        f"with {result.more_name}", "failed", "Newton steps", "unknowns solved", "contact (s)", "linear (s)", "rest (s)",
    ]  # fmt: skip
    counts = (
        "points",
        "points_low",
        "points_high",
        "points_failed",
        "newton_steps",
        "unknowns_solved",
    )
    clocks = ("seconds_contact", "seconds_linear", "seconds_rest")
    rows = []
    for case in result.cases:
        response = peak_response(result, case)
        row = [
            case.label,
            quantity(case.excitation, "N"),
            quantity(response * case.excitation, "m"),
        ]
        row += [number(response * scale.factor, 4), fixed(peak_hz(result, case), 2)]
        row += [fixed(_optional(result, name, case.index), 0) for name in counts]
        row += [fixed(_optional(result, name, case.index), 2) for name in clocks]
        rows.append(row)
    return _work_sentence(result) + html_table(head, rows)


def _work_sentence(result: Result) -> str:
    spent = {
        name: float(np.nansum(result.floats(f"seconds_{name}")))
        for name in ("contact", "linear", "rest")
        if result.has(f"seconds_{name}")
    }
    total = sum(spent.values())
    if total <= 0:
        return ""
    words = {"contact": "the contact laws", "linear": "linear algebra", "rest": "the rest"}
    shares = [f"{number(100 * s / total, 2)} % in {words[name]}" for name, s in spent.items()]
    return f"<p>The solver took {quantity(total, 's')}: {', '.join(shares)}.</p>"


def reference(result: Result) -> str:
    """Say what twice as many harmonics would change."""
    names = ("reference_worst_percent", "reference_worst_hz", "reference_above")
    if not result.has(*names):
        return "<p>Whether more harmonics are needed was not asked for in this run (option <code>--verify-harmonics</code>).</p>"
    rows = []
    for case in result.cases:
        worst, hz, above = (float(result.floats(name)[case.index]) for name in names)
        rows.append([case.label, predicted(worst), fixed(hz, 2), fixed(above, 0)])
    head = [RATIO, "largest predicted change", "at (Hz)", "points above the threshold"]
    text = f"<p>What twice as many harmonics as {result.high_name} are predicted to change at the accepted points: the change of the complex amplitude, phase included, over its size.</p>"
    said = (f"<li>{escape(str(s))}</li>" for s in result.data["reference_sentence"].values)
    return text + html_table(head, rows) + f"<ul>{''.join(said)}</ul>"


def verification(result: Result) -> str:
    """Time integration against harmonic balance."""
    names = ("verify_case", "verify_frequency_hz", "verify_transient", "verify_balance")
    if not result.has(*names, "verify_difference_percent"):
        return (
            "<p>Time integration was not asked for in this run (option <code>--verify</code>).</p>"
        )
    difference = result.floats("verify_difference_percent")
    rows = []
    for k, case in enumerate(result.floats("verify_case")):
        known = np.isfinite(case)
        ratio = float(result.floats("load_ratio")[int(case)]) if known else float("nan")
        settled = _optional(result, "verify_settled", k)
        rows.append(
            [
                number(ratio, 4),
                fixed(float(result.floats("verify_frequency_hz")[k]), 3),
                quantity(float(result.floats("verify_transient")[k]), "m", 5),
                quantity(float(result.floats("verify_balance")[k]), "m", 5),
                percent(float(difference[k])),
                NONE if not np.isfinite(settled) else ("yes" if settled else "no"),
                fixed(_optional(result, "verify_periods", k), 0),
            ]
        )
    finite = np.abs(difference[np.isfinite(difference)])
    worst = percent(float(finite.max())) if finite.size else NONE
    head = [
        RATIO, "frequency (Hz)", "by time integration", "by harmonic balance", "difference", "settled", "periods",
    ]  # fmt: skip
    text = f"<p>First-harmonic amplitude of {result.output_name}: the two independent ways differ by at most {worst}.</p>"
    return text + html_table(head, rows) + _sentences(result)


def _sentences(result: Result) -> str:
    """List what each check said, in words."""
    if not result.has("verify_sentence"):
        return ""
    said = (f"<li>{escape(str(s))}</li>" for s in result.data["verify_sentence"].values)
    return f"<ul>{''.join(said)}</ul>"


def retention(result: Result) -> str:
    """How much the small retention stiffness of the damper moves the peak."""
    shift = (
        result.floats("retention_peak_shift")
        if result.has("retention_peak_shift")
        else np.array([])
    )
    if not np.isfinite(shift).any():
        return (
            "<p>The influence of the damper's retention stiffness was not computed in this run.</p>"
        )
    known = [c for c in result.cases if np.isfinite(shift[c.index])]
    worst = max(known, key=lambda c: abs(shift[c.index]))
    rows = [
        [
            c.label,
            percent(100 * float(shift[c.index])),
            number(_optional(result, "retention_frequency_shift_hz", c.index)),
        ]
        for c in known
    ]
    rows += [[c.label, "no periodic motion found", NONE] for c in result.cases if c not in known]
    text = (
        "<p>With a retention stiffness ten times smaller the peak changes most for "
        f"{RATIO} = {worst.label}: by {percent(100 * float(shift[worst.index]))}.</p>"
    )
    return text + html_table([RATIO, "change of the peak", "change of its frequency (Hz)"], rows)


def provenance(result: Result, versions: dict[str, str]) -> str:
    """Who made this, with what, from which study."""
    rows = [
        ["created", escape(result.text("created", NONE))],
        ["stickslip", escape(result.text("stickslip_version", NONE))],
        *[[escape(name), escape(version)] for name, version in versions.items()],
        ["wall time", quantity(result.scalar("wall_seconds", float("nan")), "s")],
        ["samples per period", fixed(result.scalar("samples", float("nan")), 0)],
        ["harmonics", f"{result.low_name} and {result.high_name}, chosen by {result.selection}"],
    ]
    study = escape(result.text("study_toml"))
    text = html_table([], rows, numeric=False)
    if study:
        text += f"<details><summary>The study file</summary><pre>{study}</pre></details>"
    return text
