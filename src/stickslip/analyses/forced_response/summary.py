"""Terminal tables of a forced response: cases, frequencies that needed more harmonics, checks."""

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.records.bounds import BOUND
from stickslip.analyses.forced_response.stability.stable_words import all_lines, said_of
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.working_range import TITLE, range_lines
from stickslip.harmonic.harmonic_set import named
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import LEVELS, said

FIRST = "first harmonic"  # what amplitudes are as a rule
HEAD = ("peak mm", "at Hz")
COUNTS = ("points", "points_low", "points_high", "points_failed", "newton_steps", "unknowns_solved")
SECONDS = ("seconds_contact", "seconds_linear", "seconds_rest")


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
    rows = tuple(_row(data, i, label) for i, label in enumerate(labels))
    found = [
        TextTable("Forced response" + f", {name}" * (name != FIRST), head, rows),
        _of_orders(data, labels),
        _of_blades(data, labels),
        _lines(TITLE, range_lines(data)),
        _lines(_choice_title(data), choices(data), detail=True),
        _lines("Against more harmonics", _sentences(data, "reference_sentence", labels)),
        _lines("Is it stable?", all_lines(data, labels), detail=True),
        _lines("Bifurcations", bifurcation_lines(data, labels)),
        _lines("In time, where no periodic motion stands for it", _along(data, "not_periodic", labels)),
        _lines("Against time integration", _along(data, "verify", labels)),
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
    return f"Frequencies are those of engine order {base}, the common divisor: {', '.join(acts)}."


def _of_orders(data: xr.Dataset, labels: list[str]) -> TextTable:
    """Return the peak of each engine order, if several act at once."""
    head = ("case", "engine order", *HEAD, "its own Hz")
    rows = []
    for i, label in enumerate(labels):
        own = data.isel(point=np.flatnonzero(data["point_case"].values == i), output=0)
        for k, m in enumerate(several_orders(data)):
            size = own["driven_amplitude"].values[:, k]
            if np.isfinite(size).any():
                at = int(np.nanargmax(size))
                hertz = float(own["frequency_hz"][at])
                times = m / int(data.attrs["engine_order"])
                rows.append((label, str(m), f"{1e3 * size[at]:.5g}", f"{hertz:.3f}", f"{times * hertz:.3f}"))
    lines = (orders_sentence(data),) if rows else ()
    return TextTable("Largest amplitude of each engine order", head, tuple(rows), lines)


def _of_blades(data: xr.Dataset, labels: list[str]) -> TextTable:
    """Return amplification and largest blade of a mistuned wheel."""
    title = "Blades of the wheel"
    if "amplification" not in data:
        return TextTable(title, (), ())
    head = ("case", "largest blade", "amplification", "tuned mm", "at Hz", "localisation")
    rows = tuple(
        (
            label,
            str(int(case["largest_blade"])),
            f"{float(case['amplification']):.4f}",
            f"{1e3 * float(case['tuned_peak_amplitude']):.5g}",
            f"{float(case['tuned_peak_hz']):.3f}",
            f"{float(case['localisation']):.3f}",
        )
        for label, case in zip(labels, (data.isel(case=i) for i in range(len(labels))), strict=True)
    )
    bound = f"{BOUND} is {float(data['whitehead'][0]):.3g}."
    return TextTable(title, head, rows, (bound,))


def _choice_title(data: xr.Dataset) -> str:
    chooser = data.attrs["selection"]
    if data.attrs["passages"] == "auto":
        return f"Which harmonics {chooser} asked for along the branch"
    return f"Where {chooser} asked for more harmonics"


def choices(data: xr.Dataset) -> tuple[str, ...]:
    """List, for each case, the frequencies with more harmonics, and the work of the selection; empty without a choice."""
    labels = [str(x) for x in data["case_label"].values]
    told = _sentences(data, "choice_sentence", labels)
    return (*told, cost_sentence(data)) if told and data.sizes["point"] else told


def cost_sentence(data: xr.Dataset) -> str:
    """Compare the work of the selection with the reference harmonics at every frequency."""
    high = np.atleast_1d(data.attrs["high_harmonics"])
    solved, points = int(data["unknowns_solved"].sum()), data.sizes["point"]
    each = data.sizes["retained"] * (2 * high.size - 1)
    everywhere = points * each
    return (
        f"{solved} unknowns were solved in all; H = {named(high)} everywhere would be about {points} points × {each} unknowns = "
        f"{everywhere} (an estimate: as many points, each solved once), so that choosing took {100 * solved / everywhere:.0f} % of it."
    )


def more_name(data: xr.Dataset) -> str:
    """Return the name of points with other harmonics than those of the first passage."""
    kept = {tuple(np.flatnonzero(row)) for row in data["harmonic_kept"].values}
    supports = [tuple(np.atleast_1d(data.attrs[f"{w}_harmonics"])) for w in ("low", "high")]
    alike = kept <= set(supports) and np.isfinite(data.attrs["selection_threshold"])
    return f"H = {named(supports[1])}" if alike else "other H"


def _always_high(data: xr.Dataset) -> bool:
    return bool(data.attrs["selection"] == "always_high")


def _row(data: xr.Dataset, i: int, label: str) -> tuple[str, ...]:
    case = data.isel(case=i)
    return (
        label,
        _millimetres(1e3 * float(case["peak_amplitude"])),
        f"{float(case['peak_frequency_hz']):.3f}",
        LEVELS[int(case["case_verdict"])],
        said_of(Curve(data, i).peak_stability),
        *(str(int(case[name])) for name in COUNTS),
        f"{sum(float(case[name]) for name in SECONDS):.2f}",
    )


def _millimetres(size: float) -> str:
    """Write a peak with more digits than shown: columns round it, and rounding twice gives another last digit."""
    return f"{size:.7g}" if size >= 1e-4 else f"{size:.5g}"


def bifurcation_lines(data: xr.Dataset, labels: list[str]) -> tuple[str, ...]:
    """Return the bifurcations and side branches found, and the limits of the search; empty if not asked for."""
    if "bifurcations_limits" not in data:
        return ()
    return (*_along(data, "bifurcation", labels), *beside_bifurcations(data, labels))


def beside_bifurcations(data: xr.Dataset, labels: list[str]) -> tuple[str, ...]:
    """Return the outcome of the side branches, and the limits of the search."""
    limits = _sentences(data, "bifurcations_limits", labels)
    return (*_along(data, "side_branch", labels), *limits)


def _lines(title: str, lines: tuple[str, ...], *, detail: bool = False) -> TextTable:
    return TextTable(title, (), (), lines, detail)


def _sentences(data: xr.Dataset, name: str, labels: list[str]) -> tuple[str, ...]:
    if name not in data:
        return ()
    told = zip(labels, map(str, data[name].values), strict=True)
    return tuple(said(label, text) for label, text in told if text)


def _along(data: xr.Dataset, name: str, labels: list[str]) -> tuple[str, ...]:
    """Return the sentences of single points, with the labels of their cases."""
    if f"{name}_sentence" not in data:
        return ()
    told = zip(data[f"{name}_case"].values, data[f"{name}_sentence"].values, strict=True)
    return tuple(said(labels[i], str(text)) for i, text in told)
