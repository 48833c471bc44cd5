"""The SAFE diagram: modes that engine orders can excite at a speed."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.operation import answered
from stickslip.analyses.waves.page.waves import NEEDED, Waves, diameter_axes, mode_lines, view_of
from stickslip.analyses.waves.records import Interference, Pair, contact_state, hertz, with_contacts
from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import ALARM, GRID, INK, MUTED, Plot, ring, shade, styled
from stickslip.report.quantities import NONE, counted, number, percent
from stickslip.report.section import Block, Card, Section, Table

_MOST_TOLD = 3  # near resonances in the answer
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
    # the line folds at the diameter n/2, which for an odd number of sectors n is no whole number
    folded = np.abs(orders - sectors * np.round(orders / sectors))
    return folded, orders * hertz


def safe_diagram(view: Waves[Interference]) -> Plot:
    """Draw the interference or SAFE diagram: the modes that engine orders excite at a speed."""
    found, sectors = view.found, view.sectors
    turns = view.rpm / 60
    orders = np.unique([pair.engine_order for pair in found.pairs])
    figure = go.Figure(mode_lines(view))
    top = 1.08 * max(float(hertz(found).max()), float(orders.max()) * turns)
    x, y = zigzag(top, sectors, turns)
    figure.add_scatter(
        x=x,
        y=y,
        mode="lines",
        name="engine orders",
        hoverinfo="skip",
        line={"color": MUTED, "width": 1.2, "dash": "dash"},
    )
    unjudged = {pair.engine_order for pair in found.pairs if pair.judged is False}
    figure.add_trace(_orders(orders, unjudged, sectors, turns))
    shaded = _shade_operation(figure, view, orders)
    near = [pair for pair in found.pairs if pair.near]
    if near:
        figure.add_trace(_near(view, near))
    styled(figure, 600)
    diameter_axes(figure, view)
    figure.update_yaxes(range=[-0.04 * top, top])  # the names of low orders lie below the line
    margin = number(found.margin_percent, 3)
    verdict = (
        f"{counted(len(near), 'mode')} within {margin} % of an engine order that excites it (red)"
        if near
        else f"no mode is within {margin} % of an engine order that excites it"
    )
    caption = (
        f"At {with_contacts(f'{number(view.rpm, 5)} rpm', found.contacts)}{', ' if contact_state(found.contacts) else ' '}engine order m excites at m times the speed, and only the nodal diameter "
        f"to which the {sectors} sectors fold it (dashed zig-zag line): {verdict}. Margins refer to the speed at which order and mode meet, with the frequency's change over the speed."
    )
    if unjudged:
        caption += (
            f" **Not judged** (crossed squares): {', '.join(f'EO {m}' for m in sorted(unjudged))}, above the highest "
            "computed mode of the nodal diameter."
        )
    return Plot(f"safe{view.key}", "SAFE diagram", caption + shaded, figure)


def _shade_operation(figure: go.Figure, view: Waves[Interference], orders: IntArray) -> str:
    """Shade the operating frequencies, of speeds those of each engine order; return the sentence for the caption."""
    own, sectors = view.found.operating, view.sectors
    if not own.known:
        return ""
    if own.unit == "Hz":
        shade(figure, own.lowest, own.highest, along="y")
        return " Shaded: the operating range."
    for order in orders:
        folded = abs(order - sectors * round(order / sectors))
        low, high = (order * rpm / 60 for rpm in (own.lowest, own.highest))
        ends = {"x0": folded - 0.3, "x1": folded + 0.3, "y0": low, "y1": high}
        figure.add_shape(type="rect", **ends, fillcolor=GRID, opacity=0.7, line_width=0, layer="below")
    return f" Shaded: what the engine orders excite at the operating speeds, {own}."


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
        cliponaxis=False,
        marker={
            "symbol": ["square-x-open" if int(m) in unjudged else "square-open" for m in orders],
            "size": 8,
            "color": INK,
        },
        hovertemplate="%{text}: %{y:.6g} Hz at nodal diameter %{x}<extra></extra>",
    )


def _near(view: Waves[Interference], near: Sequence[Pair]) -> go.Scatter:
    text = [f"{view.waves[p.wave]}, mode {p.mode + 1} and EO {p.engine_order}: {100 * p.margin:+.3g} %" for p in near]
    return go.Scatter(
        x=np.array([view.found.waves[p.wave].nodal_diameter for p in near]),
        y=np.array([p.frequency_hz for p in near]),
        text=text,
        mode="markers",
        name="near resonance",
        hovertemplate="%{text}<extra></extra>",
        marker=ring(ALARM, 17, 2.4),
    )


def interference(view: Waves[Interference]) -> Table:
    """Return a table of pairs of engine order and mode, the nearest first."""
    rows = []
    for pair in sorted(view.found.pairs, key=lambda pair: abs(pair.margin)):
        verdict = "order not judged" if pair.judged is False else "clear"
        rows.append(
            [
                f"{pair.engine_order}",
                view.waves[pair.wave],
                str(pair.mode + 1),
                number(pair.frequency_hz, 6),
                number(pair.excitation_hz, 6),
                _rpm(pair.resonance_rpm, pair.margin),
                percent(100 * pair.margin, 3) if np.isfinite(pair.margin) else NONE,
                "**near resonance**" if pair.near else verdict,
            ]
        )
    at = f"at {number(view.rpm, 5)} rpm"
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
    title = with_contacts("Engine orders and the modes that they can excite", view.found.contacts)
    return Table(head, rows, title)


def _rpm(value: float, margin: float) -> str:
    """Write the speed of a resonance; far from the operating speed it is extrapolated too far for many digits."""
    if not np.isfinite(value):
        return "never" if np.isinf(value) else NONE
    return number(value, 6) if abs(margin) <= 0.2 else f"~{float(f'{value:.2g}'):.0f}"


def _cards(view: Waves[Interference]) -> list[Card]:
    found = view.found
    state = contact_state(found.contacts)
    within = f"within {number(found.margin_percent)} % of {number(view.rpm, 5)} rpm"
    near = sorted((pair for pair in found.pairs if pair.near), key=lambda pair: abs(pair.margin))
    in_operation = answered(found.operating, found.met, "resonance")
    if in_operation:  # where the machine runs, no share of one speed has to stand for it
        return in_operation
    if not near:
        return [Card("No", f"near resonance {within}", ", ".join(filter(None, (_nearest(view), state))))]
    first, *others = (_met(view, pair) for pair in near)
    more = [f"{counted(len(near), 'near resonance')} {within}", *others[: _MOST_TOLD - 1]]
    more += [f"and {len(near) - _MOST_TOLD} more"] * (len(near) > _MOST_TOLD)
    rpm = f"{number(view.rpm * (1 + near[0].margin), 5)} rpm"
    return [Card(rpm, f"{first}", "; ".join(filter(None, (", ".join(more), state))))]


def _met(view: Waves[Interference], pair: Pair) -> str:
    """Name an engine order, the mode that it meets, and the margin to the speed."""
    return f"EO {pair.engine_order} meets {view.waves[pair.wave]}, mode {pair.mode + 1} ({_signed(pair.margin)})"


def _signed(margin: float) -> str:
    return f"{'+' if margin > 0 else ''}{percent(100 * margin, 2)}"


def _nearest(view: Waves[Interference]) -> str:
    """Describe the pair with the least margin; empty if no pair meets."""
    found = [pair for pair in view.found.pairs if np.isfinite(pair.margin)]
    least = min(found, key=lambda pair: abs(pair.margin), default=None)
    if least is None:
        return ""
    return f"the nearest: {_met(view, least)} at {_rpm(view.rpm * (1 + least.margin), least.margin)} rpm"


_NEEDS = (*NEEDED, "pair_margin")
_BLOCK = Block("safe", "Interference with engine orders", (safe_diagram, interference))
SECTION: Section = Section("safe", _NEEDS, view_of(Interference), (_BLOCK,), by_case=True, cards=_cards)
