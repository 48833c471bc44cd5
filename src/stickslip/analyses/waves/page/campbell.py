"""The Campbell diagram: frequencies over speed, engine-order lines, and their crossings."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.operation import answered
from stickslip.analyses.waves.page.waves import NEEDED, Waves, view_of
from stickslip.analyses.waves.records import Campbell, contact_state, with_contacts
from stickslip.analyses.waves.verdicts import in_ranges
from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import INK, MUTED, Plot, ring, shade, styled
from stickslip.report.quantities import counted, number
from stickslip.report.section import Block, Card, Section, Table, Words
from stickslip.study.verdict import together

_MOST_TOLD = 3  # crossings in the answer
_DASHES = ("solid", "dot", "dashdot", "longdash")
# each wave has its own symbol, for prints without colours
_SYMBOLS = ("circle", "square", "diamond", "triangle-up", "x", "triangle-down", "star", "cross")
_BESIDE = 0.25  # share of the width, below which labels side by side would touch on a narrow screen
_BAND = 0.02  # half the height of a label, and its distance from the line, over the height of the figure


def _bundles(hz: FloatArray, top: float) -> IntArray:
    """Return for each line (wave, mode) the first wave whose line of the same mode coincides with it, within `_BAND`."""
    first = np.tile(np.arange(hz.shape[0])[:, None], (1, hz.shape[2]))
    for w, mode in np.ndindex(*first.shape):
        for other in range(w):
            if first[other, mode] == other and np.all(np.abs(hz[w, :, mode] - hz[other, :, mode]) <= _BAND * top):
                first[w, mode] = other
                break
    return first


def _bundled(view: Waves[Campbell], waves: Sequence[int]) -> str:
    """Return one name for waves whose lines coincide, such as ``ND 4, 6``."""
    if len(waves) == 1 or view.both:
        return together([view.waves[w] for w in waves])
    return f"ND {in_ranges({view.found.waves[w].nodal_diameter for w in waves})}"


def _label_places(hz: FloatArray, top: float, first: IntArray) -> tuple[IntArray, IntArray]:
    """Return the label position of each line (wave, mode): index of the speed, and side (1 above, -1 below, 0 no label).

    The label stands at the first speed without another line or label in the way. Lines that coincide share the label of
    the `first`.
    """
    speed, side = (np.zeros((hz.shape[0], hz.shape[2]), dtype=np.int64) for _ in range(2))
    side[first == np.arange(len(hz))[:, None]] = 1
    taken: list[tuple[int, float]] = []
    for w, mode in np.argwhere(side):
        others_of = np.ones(side.shape, dtype=bool)
        others_of[:, mode] = first[:, mode] != w
        for s, way in ((s, way) for s in range(hz.shape[1]) for way in (1, -1)):
            middle = float(hz[w, s, mode]) + way * _BAND * top
            others = hz[:, s][others_of]
            placed = np.array([y for other, y in taken if abs(other - s) <= _BESIDE * (hz.shape[1] - 1)])
            free = np.all(np.abs(others - middle) > _BAND * top)
            if free and np.all(np.abs(placed - middle) > 2 * _BAND * top):
                speed[w, mode], side[w, mode] = s, way
                taken.append((s, middle))
                break
    return speed, side


def _branches(view: Waves[Campbell]) -> list[go.Scatter]:
    rpm, hz = view.found.speeds_rpm, np.array([w.frequencies_hz for w in view.found.waves])
    pairs = zip(view.waves, view.colours, strict=True)
    top = float(np.nanmax(hz))
    first = _bundles(hz, top)
    at, side = _label_places(hz, top, first)
    texts = {
        (w, mode): f"{_bundled(view, np.flatnonzero(first[:, mode] == w).tolist())}: {mode + 1}"
        for w, mode in np.argwhere(side).tolist()
    }
    return [
        go.Scatter(
            x=rpm,
            y=hz[w, :, mode],
            mode="lines+markers+text",
            name=name,
            legendgroup=name,
            showlegend=mode == 0,
            text=[texts.get((w, mode), "") if s == at[w, mode] else "" for s in range(len(rpm))],
            textposition=f"{'top' if side[w, mode] >= 0 else 'bottom'} {'center' if at[w, mode] else 'right'}",
            textfont={"size": 10, "color": colour},
            # beyond eight waves colours repeat with dashed lines
            line={"color": colour, "width": 1.8, "dash": _DASHES[(w // 8) % len(_DASHES)]},
            marker={"size": 6, "symbol": _SYMBOLS[w % len(_SYMBOLS)]},
            hovertemplate=f"{name}, mode {mode + 1}: %{{y:.6g}} Hz at %{{x:.5g}} rpm<extra></extra>",
        )
        for w, (name, colour) in enumerate(pairs)
        for mode in range(hz.shape[2])
    ]


def _orders(view: Waves[Campbell], top: float) -> list[go.Scatter]:
    """Draw the engine-order lines inside the figure, each with its name at the end."""
    last, first = view.found.speeds_rpm.max(), view.found.speeds_rpm.min()
    traces = []
    for index, order in enumerate(view.found.engine_orders.astype(int)):
        end = last if order == 0 else min(last, top * 60 / order)
        if end <= first:
            continue
        x = np.array([first, end])
        traces.append(
            go.Scatter(
                x=x,
                y=order * x / 60,
                mode="lines+text",
                text=["", f"EO {order}"],
                name="engine orders",
                textposition="middle right" if end == last else "top center",
                textfont={"size": 11, "color": MUTED},
                legendgroup="orders",
                showlegend=index == 0,
                line={"color": MUTED, "width": 1, "dash": "dash"},
                cliponaxis=False,
                hovertemplate=f"EO {order}: %{{y:.6g}} Hz at %{{x:.5g}} rpm<extra></extra>",
            )
        )
    return traces


def _crossings(view: Waves[Campbell]) -> go.Scatter:
    names, found = view.waves, view.found.crossings
    return go.Scatter(
        x=np.array([c.speed_rpm for _, c in found]),
        y=np.array([c.frequency_hz for _, c in found]),
        text=[f"EO {c.engine_order} meets {names[w]}, mode {c.mode + 1}" for w, c in found],
        mode="markers",
        name="crossings",
        marker=ring(INK, 12, 2),
        hovertemplate="%{text}: %{y:.6g} Hz at %{x:.6g} rpm<extra></extra>",
    )


def _not_shown(view: Waves[Campbell], top: float) -> str:
    """Name the engine orders that leave the figure, and the speed from which their crossings are unknown."""
    last, first = float(view.found.speeds_rpm.max()), float(view.found.speeds_rpm.min())
    asked = [int(m) for m in view.found.engine_orders]
    cut = [f"EO {m}" for m in asked if first < top * 60 / m < last]
    outside = [f"EO {m}" for m in asked if top * 60 / m <= first]
    text = f" Cut at the upper edge of the picture: the lines of {', '.join(cut)}." if cut else ""
    if outside:
        text += f" Above the picture at all speeds: {', '.join(outside)}."
    if view.found.unfollowed:
        named = [f"EO {own.engine_order} from {own.from_rpm:.4g} rpm" for own in view.found.unfollowed]
        text += (
            " **Not judged**, because they lie above the followed modes of the nodal diameters that they excite: "
            f"{', '.join(named)}."
        )
    return text


def campbell_diagram(view: Waves[Campbell]) -> Plot:
    """Draw frequencies against speed with engine-order lines and the crossings of modes that they excite."""
    hz, rpm = np.array([w.frequencies_hz for w in view.found.waves]), view.found.speeds_rpm
    top = 1.06 * float(hz[np.isfinite(hz)].max())
    figure = go.Figure([*_orders(view, top), *_branches(view)])
    n = len(view.found.crossings)
    if n:
        figure.add_trace(_crossings(view))
    if view.found.operating.known:
        shade(
            figure,
            view.found.operating.lowest,
            view.found.operating.highest,
            along="xy"[view.found.operating.unit == "Hz"],
        )
    styled(figure, 620)
    span = float(np.ptp(rpm))
    figure.update_xaxes(title_text="speed (rpm)", range=[rpm.min() - 0.01 * span, rpm.max() + 0.06 * span])
    figure.update_xaxes(exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text="frequency (Hz), rotating frame", range=[0, 1.04 * top])
    found = f"{counted(n, 'crossing')} marked" if n else "no crossing in the range"
    caption = (
        f"{counted(hz.shape[2], 'mode')} of {counted(len(hz), 'wave')} at {counted(len(rpm), 'speed')} from "
        f"{number(float(rpm.min()), 5)} to {number(float(rpm.max()), 5)} rpm, {with_contacts('in the frame that turns with the wheel', view.found.contacts)}. "
        f"Lines are labelled with wave and mode; lines that coincide share a label. Engine orders are thin and dashed. Circles mark where an order excites the nodal diameter of the mode ({found}).{f' Shaded: the {view.found.operating.name}.' * view.found.operating.known}{_not_shown(view, top)}"
    )
    return Plot(f"campbell{view.key}", "Campbell diagram", caption, figure)


def crossings(view: Waves[Campbell]) -> Table | Words:
    """Return the crossings of a Campbell diagram in the order of speed."""
    title = with_contacts("Crossings", view.found.contacts)
    if not view.found.crossings:
        told = "No engine order meets a mode that it excites within the speeds."
        return Words((told,), title)
    rows = [
        [number(c.speed_rpm, 6), number(c.frequency_hz, 6), f"{c.engine_order}", view.waves[w], str(c.mode + 1)]
        for w, c in sorted(view.found.crossings, key=lambda met: met[1].speed_rpm)
    ]
    head = ["speed (rpm)", "frequency (Hz)", "engine order", "wave", "mode"]
    own = view.found.operating
    if own.known:
        met = [own.at(one.rpm, one.order) for one in sorted(view.found.met, key=lambda one: one.rpm)]
        head, rows = [*head, own.name], [[*row, own.where(at)] for row, at in zip(rows, met, strict=True)]
    return Table(head, rows, title)


def _cards(view: Waves[Campbell]) -> list[Card]:
    rpm = view.found.speeds_rpm
    over = f"from {number(float(rpm.min()), 5)} to {number(float(rpm.max()), 5)} rpm"
    met = sorted(view.found.crossings, key=lambda one: one[1].speed_rpm)
    told = [
        f"EO {c.engine_order} meets {view.waves[w]}, mode {c.mode + 1} at {number(c.speed_rpm, 4)} rpm"
        for w, c in met[:_MOST_TOLD]
    ]
    told += [f"and {len(met) - _MOST_TOLD} more"] * (len(met) > _MOST_TOLD)
    count, noun = counted(len(met), "crossing").split(" ")
    note = "; ".join(filter(None, (", ".join(told), contact_state(view.found.contacts))))
    operating = answered(view.found.operating, view.found.met, "crossing")
    return [*operating, Card(count if met else "No", f"{noun if met else 'crossing'} with engine orders {over}", note)]


_NEEDS = (*NEEDED, "speed_rpm")
_BLOCK = Block("campbell", "Frequencies against speed", (campbell_diagram, crossings))
SECTION: Section = Section(
    "campbell", _NEEDS, view_of(Campbell), (_BLOCK,), by_case=True, cards=_cards, yields_to=("safe",)
)
