"""Tables of a forced response: cases, all solutions, and the checks."""

import numpy as np

from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import named
from stickslip.report.content import Table
from stickslip.report.quantities import NONE, aligned, amplitude, column, fixed, number, percent, predicted, quantity
from stickslip.study.verdict import said


def peaks(response: Response) -> Table:
    """Return a table with one row a case: peak, points, work."""
    cases = response.cases
    value = np.array([response.peak_response(c) for c in cases])
    force = np.array([c.excitation for c in cases])
    newton, forces = column(force, "N")
    length, sizes = column(value * (force if response.per_force else 1.0), response.length, millimetres=True)
    unit, ratios = column(value if response.per_force else value * np.nan, response.unit)
    zeta = np.array([response.number_of("peak_damping", c) for c in cases])
    head = [
        f"excitation ({newton})",
        f"peak ({length})",
        f"peak / force ({unit})",
        "at (Hz)",
        "damping ratio (%)",
        "quality factor",
        "verdict",
        "points",
        f"with H = {response.first_name}",
        f"with {response.more_name if response.decides else 'other H'}",
        "failed",
        "Newton steps",
        "unknowns solved",
        "contact (s)",
        "linear (s)",
        "rest (s)",
    ]
    counts = ["points", *(f"points_{k}" for k in ("low", "high", "failed")), "newton_steps", "unknowns_solved"]
    clocks = ("seconds_contact", "seconds_linear", "seconds_rest")
    dampings, qualities = aligned(100 * zeta, 3), aligned(0.5 / zeta, 3)
    rows = [
        [case.short, *own, fixed(response.peak_hz(case), 2), damping, quality, response.level(case) or NONE]
        + [fixed(response.number_of(name, case), 0) for name in counts]
        + [fixed(response.number_of(name, case), 2) for name in clocks]
        for case, *own, damping, quality in zip(cases, forces, sizes, ratios, dampings, qualities, strict=True)
    ]
    told = [*_damping_sentence(zeta), *_work_sentence(response)]
    return response.table("", told, head, rows)


def _damping_sentence(zeta: FloatArray) -> list[str]:
    if not np.isfinite(zeta).any():
        return []
    text = (
        "The damping ratio is that of a linear oscillator which loses as much at the peak: the work of the load in a cycle over 4π "
        "times the largest energy that structure and contacts store. The quality factor is half its inverse."
    )
    return [text]


def _work_sentence(response: Response) -> list[str]:
    words = {"contact": "the contact laws", "linear": "linear algebra", "rest": "the rest"}
    spent = {
        text: float(np.nansum(response.floats(f"seconds_{name}")))
        for name, text in words.items()
        if response.has(f"seconds_{name}")
    }
    total = sum(spent.values())
    if total <= 0:
        return []
    shares = [f"{number(100 * s / total, 2)} % in {text}" for text, s in spent.items()]
    return [f"The solver took {quantity(total, 's')}: {', '.join(shares)}."]


def attempts(response: Response) -> Table | None:
    """Return a table with one row a case and set of harmonics: the work, including discarded solutions."""
    if not response.has("attempt_case", "attempt_kept"):
        return None
    case = response.integers("attempt_case")
    kept = response.values("attempt_kept", "attempt", "harmonic")
    sets = np.array([named(np.flatnonzero(row)) for row in kept])
    numbers = ("attempt_newton_iterations", "attempt_unknowns", "attempt_seconds")
    columns = [response.floats(name) for name in numbers]
    good, rows = response.floats("attempt_status") == 0, []
    for one in response.cases:
        mine = case == one.index
        for own in sorted(set(sets[mine]), key=lambda s: (int(s.rsplit(", ", maxsplit=1)[-1]), s)):
            at = mine & (sets == own)
            sums = [float(column[at].sum()) for column in columns]
            rows.append(
                [one.short, own, str(int(at.sum())), str(int((at & ~good).sum()))]
                + [fixed(total, digits) for total, digits in zip(sums, (0, 0, 2), strict=True)]
            )
    head = ["H", "solved", "not converged", "Newton steps", "unknowns", "time (s)"]
    text = (
        "By case and harmonics, those solutions included in whose place others were "
        "accepted. The unknowns of all solutions together compare the work of strategies, whatever the machine."
    )
    return response.table("Everything that was solved", (text,), head, rows)


def sentences(response: Response, name: str) -> list[str]:
    """List the outcome of each check in words."""
    if not response.has(name):
        return []
    each = [str(s) for s in response.data[name].values]
    rows = f"{name.removesuffix('_sentence')}_case"
    at = response.integers(rows) if response.has(rows) else np.arange(len(each))
    labels = [response.cases[int(k)].label for k in at]
    return [said(label, text) for label, text in zip(labels, each, strict=True)]


def more_harmonics(response: Response) -> Table | None:
    """Report the predicted change by twice as many harmonics."""
    names = ("reference_worst_percent", "reference_worst_hz", "reference_above")
    if not response.has(*names):
        return None
    rows = []
    for case in response.cases:
        worst, hz, above = (response.number_of(name, case) for name in names)
        rows.append([case.short, predicted(worst), fixed(hz, 2), fixed(above, 0)])
    head = ["largest predicted change", "at (Hz)", "points above the threshold"]
    text = (
        f"What twice as many harmonics as {response.high_name} are predicted to change at the accepted "
        "points: the change of the complex amplitude, phase included, over its size."
    )
    items = sentences(response, "reference_sentence")
    return response.table("More harmonics", (text,), head, rows, items=items)


def time_integration(response: Response) -> Table | None:
    """Compare time integration with harmonic balance."""
    words = ("case", "frequency_hz", "transient", "balance", "difference_percent")
    names = [f"verify_{word}" for word in words]
    if not response.has(*names):
        return None
    columns = [response.floats(name) for name in names]
    nothing = np.full(len(columns[0]), np.nan)
    periods = response.floats("verify_periods") if response.has("verify_periods") else nothing
    motion = [NONE] * len(columns[0])
    if response.has("verify_settled"):
        motion = [("not settled", "settled")[int(k)] for k in response.integers("verify_settled")]
    if response.has("verify_motion"):
        told = response.labels_of("verify_motion")
        motion = [word or known for word, known in zip(told, motion, strict=True)]
    rows = [
        [
            response.cases[int(case)].short if np.isfinite(case) else NONE,
            fixed(float(hz), 3),
            amplitude(float(transient), response.length, 5),
            amplitude(float(balance), response.length, 5),
            percent(float(off)),
            word,
            fixed(float(n), 0),
        ]
        for case, hz, transient, balance, off, word, n in zip(*columns, motion, periods, strict=True)
    ]
    finite = np.abs(columns[-1][np.isfinite(columns[-1])])
    worst = percent(float(finite.max())) if finite.size else NONE
    ways = ["by time integration", "by harmonic balance"]
    head = ["frequency (Hz)", *ways, "difference", "motion in time", "periods"]
    text = f"Amplitude of {response.output_name}: the two independent ways differ by at most {worst}."
    items = sentences(response, "verify_sentence")
    return response.table("Time integration", (text,), head, rows, items=items)


def retention(response: Response) -> Table | None:
    """Report the change of the peak by the retention stiffness of rigid bodies."""
    shift = {c: response.number_of("retention_peak_shift", c) for c in response.cases}
    known = [c for c in response.cases if np.isfinite(shift[c])]
    if not known:
        return None
    worst = max(known, key=lambda c: abs(shift[c]))
    moved = {c: number(response.number_of("retention_frequency_shift_hz", c)) for c in known}
    rows = [[c.short, percent(100 * shift[c]), moved[c]] for c in known]
    rows += [[c.short, "no periodic motion found", NONE] for c in response.cases if c not in known]
    text = (
        "With a retention stiffness ten times smaller the peak changes most"
        f"{worst.where}: by {percent(100 * shift[worst])}."
    )
    head = ["change of the peak", "change of its frequency (Hz)"]
    return response.table("Retention", (text,), head, rows)
