"""The SAFE diagram: which modes engine orders can excite at a speed."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.waves.page.waves import NEEDED, Waves, diameter_axes, mode_lines
from stickslip.arrays import FloatArray, IntArray
from stickslip.report.content import Table
from stickslip.report.plot import ALARM, INK, MUTED, Plot, ring, styled
from stickslip.report.quantities import NONE, counted, number, percent
from stickslip.report.section import Block, Card, Section

_MOST_LABELS = 40  # engine orders written beside the zig-zag line


def zigzag(highest_hz: float, sectors: int, hertz: float) -> tuple[FloatArray, FloatArray]:
    """Return the line of all engine orders over the nodal diameters that they excite.

    Parameters
    ----------
    highest_hz
        Upper end of the line, Hz.
    sectors
        Number of sectors.
    hertz
        Speed in revolutions a second.

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


def safe_diagram(view: Waves) -> Plot:
    """Draw the interference or SAFE diagram: the modes that engine orders excite at a speed."""
    hertz, sectors = view.scalar("speed_rpm") / 60, view.sectors
    orders = np.unique(view.integers("pair_engine_order"))
    figure = go.Figure(mode_lines(view))
    top = 1.08 * max(float(view.floats("frequency_hz").max()), float(orders.max()) * hertz)
    x, y = zigzag(top, sectors, hertz)
    figure.add_trace(
        go.Scatter(
            x=x,
            y=y,
            mode="lines",
            name="engine orders",
            hoverinfo="skip",
            line={"color": MUTED, "width": 1.2, "dash": "dash"},
        )
    )
    unjudged = _not_judged(view)
    figure.add_trace(_orders(orders, unjudged, sectors, hertz))
    near = view.integers("pair_near") == 1
    if near.any():
        figure.add_trace(_near(view, near))
    styled(figure, 600)
    diameter_axes(figure, view)
    figure.update_yaxes(range=[-0.04 * top, top])  # the names of low orders lie below the line
    margin = number(view.scalar("margin_percent"), 3)
    verdict = (
        f"{counted(int(near.sum()), 'mode')} within {margin} % of an engine order that excites it (red)"
        if near.any()
        else f"no mode is within {margin} % of an engine order that excites it"
    )
    caption = (
        f"At {number(view.scalar('speed_rpm'), 5)} rpm engine order m excites at m times the speed, and only the nodal diameter "
        f"to which the {sectors} sectors fold it (dashed zig-zag line): {verdict}. Margins are those of the speed at which "
        "order and mode meet, with the frequency's change over the speed."
    )
    if unjudged:
        caption += (
            f" **Not judged** (crossed squares): {', '.join(f'EO {m}' for m in sorted(unjudged))}, above the highest "
            "computed mode of the nodal diameter."
        )
    return Plot(f"safe{view.key}", "SAFE diagram", caption, figure)


def _not_judged(view: Waves) -> set[int]:
    """Return the engine orders above the computed modes."""
    if not view.has("pair_judged"):
        return set()
    orders = view.integers("pair_engine_order")
    return {int(m) for m in orders[view.integers("pair_judged") == 0]}


def _orders(orders: IntArray, unjudged: set[int], sectors: int, hertz: float) -> go.Scatter:
    """Mark the engine orders on the zig-zag line, with names away from lines and modes."""
    folded = np.abs(orders - sectors * np.round(orders / sectors))
    # the line rises to the right in the first half of a turn, to the left in the second
    places = np.where(2 * (orders % sectors) < sectors, "bottom right", "top right")
    places[2 * folded == sectors] = "middle right"
    places[folded == 0] = "middle left"
    few = len(orders) <= _MOST_LABELS
    return go.Scatter(
        x=folded,
        y=orders * hertz,
        mode="markers+text" if few else "markers",
        name="engine orders asked",
        text=[f" EO {m} " for m in orders],
        textposition=list(places),
        textfont={"size": 11, "color": MUTED},
        marker={
            "symbol": ["square-x-open" if int(m) in unjudged else "square-open" for m in orders],
            "size": 8,
            "color": INK,
        },
        hovertemplate="%{text}: %{y:.6g} Hz at nodal diameter %{x}<extra></extra>",
    )


def _near(view: Waves, near: np.ndarray) -> go.Scatter:
    wave, mode = view.integers("pair_wave")[near], view.integers("pair_mode")[near]
    orders, margins = view.integers("pair_engine_order")[near], view.floats("pair_margin")[near]
    names = view.waves
    text = [
        f"{names[w]}, mode {m + 1} and EO {o}: {100 * d:+.3g} %"
        for w, m, o, d in zip(wave, mode, orders, margins, strict=True)
    ]
    return go.Scatter(
        x=view.integers("nodal_diameter")[wave],
        y=view.floats("pair_frequency_hz")[near],
        text=text,
        mode="markers",
        name="near resonance",
        hovertemplate="%{text}<extra></extra>",
        marker=ring(ALARM, 17, 2.4),
    )


def interference(view: Waves) -> Table:
    """Return a table of pairs of engine order and mode, the nearest first."""
    margin, near = view.floats("pair_margin"), view.integers("pair_near")
    order, wave, mode = (view.integers(f"pair_{name}") for name in ("engine_order", "wave", "mode"))
    own, excitation = view.floats("pair_frequency_hz"), view.floats("pair_excitation_hz")
    judged = view.integers("pair_judged") if view.has("pair_judged") else np.ones_like(near)
    known = view.has("pair_resonance_rpm")
    meeting = view.floats("pair_resonance_rpm") if known else np.full(len(margin), np.nan)
    rows = []
    for i in np.argsort(np.abs(margin), kind="stable"):
        verdict = "clear" if judged[i] else "order not judged"
        verdict = "**near resonance**" if near[i] else verdict
        rows.append(
            [
                f"{order[i]}",
                view.waves[wave[i]],
                str(mode[i] + 1),
                number(float(own[i]), 6),
                number(float(excitation[i]), 6),
                _rpm(float(meeting[i]), float(margin[i])),
                percent(100 * float(margin[i]), 3) if np.isfinite(margin[i]) else NONE,
                verdict,
            ]
        )
    at = f"at {number(view.scalar('speed_rpm'), 5)} rpm"
    head = [
        "engine order",
        "wave",
        "mode",
        f"mode {at} (Hz)",
        f"excitation {at} (Hz)",
        "resonance at (rpm)",
        "margin in speed",
        "",
    ]
    return Table(head, rows, "Engine orders and the modes that they can excite")


def _rpm(value: float, margin: float) -> str:
    """Write the speed of a resonance; far from the operating speed it is extrapolated too far for many digits."""
    if not np.isfinite(value):
        return "never" if np.isinf(value) else NONE
    return number(value, 6) if abs(margin) <= 0.2 else f"~{float(f'{value:.2g}'):.0f}"


def _cards(view: Waves) -> list[Card]:
    near, rpm = int(view.integers("pair_near").sum()), number(view.scalar("speed_rpm"), 5)
    note = f"margin {number(view.scalar('margin_percent'))} %"
    return [Card(str(near), f"near resonances at {rpm} rpm", note)]


_NEEDS = (*NEEDED, "pair_margin")
_BLOCK = Block("safe", "Interference with engine orders", (safe_diagram, interference))
SECTION: Section = Section("safe", _NEEDS, Waves, (_BLOCK,), by_case=True, cards=_cards)
