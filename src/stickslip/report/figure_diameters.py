"""The nodal-diameter map and the SAFE diagram: frequencies over nodal diameters."""

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import ALARM, INK, MUTED, Plot, styled
from stickslip.report.quantities import counted, number
from stickslip.report.wheel_result import WheelResult, colour

_MOST_LABELS = 40  # engine orders written beside the zig-zag line


def _mode_lines(result: WheelResult) -> list[go.Scatter]:
    """One line a mode over the nodal diameters, each travelling direction for itself."""
    hz = result.floats("frequency_hz")
    diameter, kinds = result.integers("nodal_diameter"), result.data["wave_kind"].values
    names = np.array(result.waves)
    # with both directions there are two frequencies at a diameter: the standing waves belong to both lines
    groups = [("", np.arange(len(names)))]
    if len(set(diameter)) < len(diameter):
        groups = [
            (f", {way}", np.flatnonzero((kinds == way) | (kinds == "standing")))
            for way in ("forward", "backward")
        ]
    traces = []
    for mode in range(hz.shape[1]):
        for g, (suffix, members) in enumerate(groups):
            order = members[np.argsort(diameter[members], kind="stable")]
            traces.append(
                go.Scatter(
                    x=diameter[order], y=hz[order, mode], mode="lines+markers", name=f"mode {mode + 1}{suffix}",
                    text=[f"{names[w]}, {kinds[w]} wave" for w in order],
                    line={"color": colour(mode), "width": 1.4, "dash": "dot" if g else "solid"},
                    marker={"size": 7, "color": colour(mode), "symbol": "diamond" if g else "circle"},
                    hovertemplate=f"mode {mode + 1}, %{{text}}: %{{y:.6g}} Hz<extra></extra>",
                )
            )  # fmt: skip
    return traces


def _axes(figure: go.Figure, result: WheelResult) -> None:
    highest = int(result.integers("nodal_diameter").max())
    figure.update_xaxes(
        title_text="nodal diameter", range=[-0.04 * highest - 0.4, 1.04 * highest + 0.4]
    )
    figure.update_xaxes(dtick=1 if highest <= 30 else None)
    figure.update_yaxes(title_text="frequency (Hz)", rangemode="tozero")


def diameter_map(result: WheelResult) -> Plot:
    """Show the frequencies over the nodal diameters."""
    figure = go.Figure(_mode_lines(result))
    reference = ""
    if result.has("reference_hz"):
        known, mode = np.nonzero(np.isfinite(result.floats("reference_hz")))
        figure.add_trace(
            go.Scatter(
                x=result.integers("nodal_diameter")[known], y=result.floats("reference_hz")[known, mode],
                mode="markers", name="reference", hovertemplate="reference: %{y:.6g} Hz<extra></extra>",
                marker={"size": 12, "symbol": "circle-open", "color": INK, "line": {"width": 1.2}},
            )
        )  # fmt: skip
        reference = " Open circles are the frequencies to compare with."
    styled(figure, 520)
    _axes(figure, result)
    if result.sectors == 1:
        figure.update_xaxes(title_text="", showticklabels=False)
    hz = result.floats("frequency_hz")
    caption = (
        f"{counted(hz.shape[1], 'mode')} of {counted(len(hz), 'wave')}, {number(hz.min(), 5)} to {number(hz.max(), 5)} Hz, "
        f"{result.text('rotation')}. Lines join the same mode number; modes of different families that come close repel each "
        f"other instead of crossing (veering).{reference}"
    )
    return Plot("diameters", "Nodal-diameter map", caption, figure)


def zigzag(highest_hz: float, sectors: int, hertz: float) -> tuple[FloatArray, FloatArray]:
    """Return the line of all engine orders over the nodal diameters that they excite.

    Parameters
    ----------
    highest_hz
        Where the line may end.
    sectors
        Of the wheel.
    hertz
        Revolutions a second.

    Returns
    -------
    diameters, frequencies_hz
        Corners of the line: engine orders 0, n/2, n, 3n/2 ..., and its end.
    """
    last = highest_hz / hertz
    orders = np.append(np.arange(0.0, last, sectors / 2), last)
    # folds at the greatest diameter, which for an odd number of sectors lies between two whole ones
    folded = np.abs(orders - sectors * np.round(orders / sectors))
    return folded, orders * hertz


def safe_diagram(result: WheelResult) -> Plot:
    """Show what engine orders excite at a speed: the interference or SAFE diagram."""
    hertz, sectors = result.scalar("speed_rpm") / 60, result.sectors
    orders = np.unique(result.integers("pair_engine_order"))
    figure = go.Figure(_mode_lines(result))
    top = 1.08 * max(float(result.floats("frequency_hz").max()), float(orders.max()) * hertz)
    x, y = zigzag(top, sectors, hertz)
    figure.add_trace(
        go.Scatter(
            x=x, y=y, mode="lines", name="engine orders", hoverinfo="skip",
            line={"color": MUTED, "width": 1.2, "dash": "dash"},
        )
    )  # fmt: skip
    unjudged = _not_judged(result)
    figure.add_trace(_orders(orders, unjudged, sectors, hertz))
    near = result.integers("pair_near") == 1
    if near.any():
        figure.add_trace(_near(result, near))
    styled(figure, 600)
    _axes(figure, result)
    margin = number(result.scalar("margin_percent"), 3)
    verdict = (
        f"{counted(int(near.sum()), 'mode')} within {margin} % of an engine order that excites it (red)"
        if near.any()
        else f"no mode is within {margin} % of an engine order that excites it"
    )
    caption = (
        f"At {number(result.scalar('speed_rpm'), 5)} rpm engine order m excites at m times the speed, and only the nodal diameter "
        f"to which the {sectors} sectors fold it (dashed zig-zag line): {verdict}. Margins are those of the speed at which "
        "order and mode meet, with the frequency's change over the speed."
    )
    if unjudged:
        caption += (
            f" <b>Not judged</b> (crossed squares): {', '.join(f'EO {m}' for m in sorted(unjudged))}, above the highest "
            "computed mode of the nodal diameter."
        )
    return Plot("safe", "SAFE diagram", caption, figure)


def _not_judged(result: WheelResult) -> set[int]:
    """Return the engine orders that excite above the computed modes."""
    if not result.has("pair_judged"):
        return set()
    orders = result.integers("pair_engine_order")
    return {int(m) for m in orders[result.integers("pair_judged") == 0]}


def _orders(orders: IntArray, unjudged: set[int], sectors: int, hertz: float) -> go.Scatter:
    """Mark the engine orders on the zig-zag line, their names where neither line nor modes run."""
    folded = np.abs(orders - sectors * np.round(orders / sectors))
    # the line rises to the right in the first half of a turn, to the left in the second
    places = np.where(2 * (orders % sectors) < sectors, "bottom right", "top right")
    places[2 * folded == sectors] = "middle right"
    places[folded == 0] = "middle left"
    few = len(orders) <= _MOST_LABELS
    return go.Scatter(
        x=folded, y=orders * hertz, mode="markers+text" if few else "markers",
        name="engine orders asked", text=[f" EO {m} " for m in orders], textposition=list(places),
        textfont={"size": 11, "color": MUTED},
        marker={
            "symbol": ["square-x-open" if int(m) in unjudged else "square-open" for m in orders],
            "size": 8, "color": INK,
        },
        hovertemplate="%{text}: %{y:.6g} Hz at nodal diameter %{x}<extra></extra>",
    )  # fmt: skip


def _near(result: WheelResult, near: np.ndarray) -> go.Scatter:
    wave, mode = result.integers("pair_wave")[near], result.integers("pair_mode")[near]
    orders, margins = result.integers("pair_engine_order")[near], result.floats("pair_margin")[near]
    names = result.waves
    text = [
        f"{names[w]}, mode {m + 1} and EO {o}: {100 * d:+.3g} %"
        for w, m, o, d in zip(wave, mode, orders, margins, strict=True)
    ]
    return go.Scatter(
        x=result.integers("nodal_diameter")[wave], y=result.floats("pair_frequency_hz")[near], text=text,
        mode="markers", name="near resonance", hovertemplate="%{text}<extra></extra>",
        marker={"symbol": "circle-open", "size": 17, "color": ALARM, "line": {"width": 2.4}},
    )  # fmt: skip
