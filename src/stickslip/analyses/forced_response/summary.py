"""Terminal tables of a forced response: cases, frequencies that needed more harmonics, checks."""

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.records.blades import BOUND
from stickslip.analyses.forced_response.records.columns import (
    BifurcationRows,
    BifurcationSearch,
    Blades,
    CaseNumbers,
    MoreHarmonics,
    MotionsInTime,
    PointFields,
    SideBranches,
    TimeChecks,
    Verdicts,
    holds,
    of_cases,
    read,
)
from stickslip.analyses.forced_response.stability.stable_words import all_lines, said_of
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.margin import stress_table
from stickslip.analyses.forced_response.verdicts.working_range import TITLE, range_lines
from stickslip.arrays import IntArray, TextArray
from stickslip.harmonic.harmonic_set import named
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import LEVELS, said

FIRST = "first harmonic"  # usual definition of amplitudes
HEAD = ("peak mm", "at Hz")


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the tables of a dataset.

    Parameters
    ----------
    data
        Dataset of `put_together`, with the label of each case.
    """
    labels = [str(x) for x in data["case_label"].values]
    more, low = more_name(data), named(np.atleast_1d(data.attrs["low_harmonics"]))
    first = named(np.atleast_1d(data.attrs["high_harmonics"])) if _always_high(data) else low
    head = (
        "case",
        *HEAD,
        "verdict",
        "peak is",
        "points",
        f"H = {first}",
        more,
        "failed",
        "Newton",
        "unknowns",
        "seconds",
    )
    name = amplitude_name(data)
    harmonics = (own.reference_sentence for own in of_cases(MoreHarmonics, data))
    in_time, checks = read(MotionsInTime, data), read(TimeChecks, data)
    rows = tuple(_row(data, i, label) for i, label in enumerate(labels))
    found = [
        TextTable("Forced response" + f", {name}" * (name != FIRST), head, rows),
        _of_orders(data, labels),
        _of_blades(data, labels),
        stress_table(data, labels),
        _lines(TITLE, range_lines(data)),
        _lines(_choice_title(data), choices(data), detail=True),
        _lines("Against more harmonics", _sentences(labels, harmonics)),
        _lines("Is it stable?", all_lines(data, labels), detail=True),
        _lines("Bifurcations", bifurcation_lines(data, labels)),
        _lines(
            "In time, where no periodic motion stands for it",
            _along(labels, in_time.not_periodic_case, in_time.not_periodic_sentence),
        ),
        _lines("Against time integration", _along(labels, checks.verify_case, checks.verify_sentence)),
    ]
    return tuple(table for table in found if table.rows or table.lines)


MEASURED = {"half_peak_to_peak": "half of peak to peak", "rms": "root mean square"}


def amplitude_name(data: xr.Dataset) -> str:
    """Return the name of the amplitude: of the driven harmonics, unless the study defines it otherwise."""
    if (told := MEASURED.get(str(data.attrs.get("amplitude_of", "first")))) is not None:
        return told
    driven = [int(h) for h in np.atleast_1d(data.attrs.get("driven_harmonics", [1]))]
    orders = several_orders(data)
    if orders:
        return f"norm of engine orders {', '.join(map(str, orders))}"
    if driven == [1]:
        return FIRST
    return f"harmonic {driven[0]}" if len(driven) == 1 else f"norm of harmonics {', '.join(map(str, driven))}"


def several_orders(data: xr.Dataset) -> list[int]:
    """Return the engine orders that act at once; none for a single one."""
    return [int(m) for m in np.atleast_1d(data.attrs.get("driven_engine_orders", []))]


def orders_sentence(data: xr.Dataset) -> str:
    """State the meaning of the frequency if several engine orders act at once."""
    base = int(data.attrs["engine_order"])
    acts = [f"engine order {m} at {m // base} times that" for m in several_orders(data)]
    return f"Frequencies belong to engine order {base}, the common divisor: {', '.join(acts)}."


def _of_orders(data: xr.Dataset, labels: list[str]) -> TextTable:
    """Return the peak of each engine order, if several act at once."""
    head = ("case", "engine order", *HEAD, "its own Hz")
    rows = []
    for i, label in enumerate(labels):
        own = Curve(data, i)
        for k, m in enumerate(several_orders(data)):
            size = own.fields.driven_amplitude[:, k, 0]
            if np.isfinite(size).any():
                at = int(np.nanargmax(size))
                hertz = float(own.hz[at])
                times = m / int(data.attrs["engine_order"])
                rows.append((label, str(m), f"{1e3 * size[at]:.5g}", f"{hertz:.3f}", f"{times * hertz:.3f}"))
    lines = (orders_sentence(data),) if rows else ()
    return TextTable("Largest amplitude of each engine order", head, tuple(rows), lines)


def _of_blades(data: xr.Dataset, labels: list[str]) -> TextTable:
    """Return amplification and largest blade of a mistuned wheel."""
    title = "Blades of the wheel"
    if not holds(Blades, data):
        return TextTable(title, (), ())
    each = of_cases(Blades, data)
    head = ("case", "largest blade", "amplification", "tuned mm", "at Hz", "localisation")
    rows = tuple(
        (
            label,
            str(case.largest_blade),
            f"{case.amplification:.4f}",
            f"{1e3 * case.tuned_peak_amplitude:.5g}",
            f"{case.tuned_peak_hz:.3f}",
            f"{case.localisation:.3f}",
        )
        for label, case in zip(labels, each, strict=True)
    )
    bound = f"{BOUND} is {each[0].whitehead:.3g}."
    return TextTable(title, head, rows, (bound,))


def _choice_title(data: xr.Dataset) -> str:
    chooser = data.attrs["selection"]
    if data.attrs["passages"] == "auto":
        return f"Which harmonics {chooser} asked for along the branch"
    return f"Where {chooser} asked for more harmonics"


def choices(data: xr.Dataset) -> tuple[str, ...]:
    """List, for each case, the frequencies with more harmonics, and the work of the selection; empty without a choice."""
    labels = [str(x) for x in data["case_label"].values]
    told = _sentences(labels, (own.choice_sentence for own in of_cases(CaseNumbers, data)))
    return (*told, cost_sentence(data)) if told and data.sizes["point"] else told


def cost_sentence(data: xr.Dataset) -> str:
    """Compare the work of the selection with the reference harmonics at every frequency."""
    high = np.atleast_1d(data.attrs["high_harmonics"])
    solved, points = sum(own.unknowns_solved for own in of_cases(CaseNumbers, data)), data.sizes["point"]
    each = data.sizes["retained"] * (2 * high.size - 1)
    everywhere = points * each
    return (
        f"{solved} unknowns were solved in all; H = {named(high)} everywhere would be about {points} points × {each} unknowns = "
        f"{everywhere} (an estimate: as many points, each solved once), so that choosing took {100 * solved / everywhere:.0f} % of it."
    )


def more_name(data: xr.Dataset) -> str:
    """Return the name of points with other harmonics than the first passage."""
    kept = {tuple(np.flatnonzero(row)) for row in read(PointFields, data).harmonic_kept}
    supports = [tuple(np.atleast_1d(data.attrs[f"{w}_harmonics"])) for w in ("low", "high")]
    alike = kept <= set(supports) and np.isfinite(data.attrs["selection_threshold"])
    return f"H = {named(supports[1])}" if alike else "other H"


def _always_high(data: xr.Dataset) -> bool:
    return bool(data.attrs["selection"] == "always_high")


def _row(data: xr.Dataset, i: int, label: str) -> tuple[str, ...]:
    case = Curve(data, i)
    own, level = case.numbers, int(case.read(Verdicts).case_verdict)
    counts = (own.points, own.points_low, own.points_high, own.points_failed, own.newton_steps, own.unknowns_solved)
    return (
        label,
        _millimetres(1e3 * own.peak_amplitude),
        f"{own.peak_frequency_hz:.3f}",
        LEVELS[level] if level >= 0 else "",
        said_of(case.peak_stability),
        *map(str, counts),
        f"{own.seconds_contact + own.seconds_linear + own.seconds_rest:.2f}",
    )


def _millimetres(size: float) -> str:
    """Write a peak with more digits than shown: columns round it, and rounding twice gives another last digit."""
    return f"{size:.7g}" if size >= 1e-4 else f"{size:.5g}"


def bifurcation_lines(data: xr.Dataset, labels: list[str]) -> tuple[str, ...]:
    """Return the bifurcations and side branches found, and the limits of the search; empty if not requested."""
    if not holds(BifurcationSearch, data):
        return ()
    own = read(BifurcationRows, data)
    return (*_along(labels, own.bifurcation_case, own.bifurcation_sentence), *beside_bifurcations(data, labels))


def beside_bifurcations(data: xr.Dataset, labels: list[str]) -> tuple[str, ...]:
    """Return the outcome of the side branches, and the limits of the search."""
    limits = (own.bifurcations_limits for own in of_cases(BifurcationSearch, data))
    own = read(SideBranches, data)
    return (*_along(labels, own.side_branch_case, own.side_branch_sentence), *_sentences(labels, limits))


def _lines(title: str, lines: tuple[str, ...], *, detail: bool = False) -> TextTable:
    return TextTable(title, (), (), lines, detail)


def _sentences(labels: Sequence[str], texts: Iterable[str]) -> tuple[str, ...]:
    return tuple(said(label, text) for label, text in zip(labels, texts, strict=True) if text)


def _along(labels: Sequence[str], case: IntArray | None, sentences: TextArray) -> tuple[str, ...]:
    """Return the sentences of single points, with the labels of their cases."""
    return () if case is None else _sentences([labels[i] for i in case], map(str, sentences))
