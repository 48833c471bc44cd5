"""The run-up: a Campbell diagram with the response on it, amplitudes over speed, static forces."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.columns import CaseView
from stickslip.analyses.operation import Met, answered
from stickslip.analyses.run_up.records import LinePoint, RunUp
from stickslip.arrays import FloatArray
from stickslip.report.plot import BROKEN, INK, MUTED, Plot, colour, shade, styled
from stickslip.report.quantities import counted, number, percent, quantity, scale_for
from stickslip.report.section import Block, Card, Section, Table

_LARGEST, _SMALLEST = 26.0, 3.0  # sizes of markers for the largest and for zero amplitude
_SCALE = [[0.0, "#dfe6ee"], [0.35, "#56b4e9"], [0.7, "#e69f00"], [1.0, "#c0262d"]]


class RunUpView(CaseView[RunUp]):
    """One case of a run-up."""

    kind = RunUp

    def amplitude(self, points: Sequence[LinePoint]) -> FloatArray:
        """Return (points,) amplitudes of the output whose peak is resolved."""
        return np.array([point.amplitude[self.found.report_output or 0] for point in points])

    @property
    def output_name(self) -> str:
        """Name of the output whose peak is resolved."""
        return str(self.found.output_label[self.found.report_output or 0])


def campbell_with_response(view: RunUpView) -> Plot:
    """Draw a Campbell diagram with stuck and open contacts, and the amplitudes on its engine-order lines."""
    found = view.found
    hz, amplitude = np.array([point.frequency_hz for point in found.points]), view.amplitude(found.points)
    scale = scale_for(amplitude, "m")
    top = float(np.nanmax(amplitude)) if np.isfinite(amplitude).any() else 1.0
    figure = go.Figure()
    speeds = np.asarray(found.line_speed_rpm)
    span = [float(hz.min()), float(hz.max())]
    pad = 0.08 * (span[1] - span[0])
    for name, dash, title in (("stuck_hz", "solid", "stuck"), ("open_hz", "dot", "open")):
        shown: dict[int, FloatArray] = {line.wave_number: getattr(line, name) for line in reversed(found.lines)}
        for j, (wave, lines) in enumerate(sorted(shown.items())):
            for mode in range(lines.shape[1]):
                figure.add_scatter(
                    x=speeds,
                    y=lines[:, mode],
                    mode="lines",
                    name=f"wave {wave}, {title}",
                    legendgroup=f"{wave}{title}",
                    showlegend=mode == 0,
                    line={"color": colour(j), "width": 1.3, "dash": dash},
                    hovertemplate=f"wave {wave}, mode {mode + 1}, {title}: %{{y:.6g}} Hz at %{{x:.5g}} rpm<extra></extra>",
                )
    for i, line in enumerate(found.lines):
        order = line.engine_order
        own = [point for point in found.along(line) if np.isfinite(view.amplitude([point])[0])]
        sizes = view.amplitude(own)
        figure.add_scatter(
            x=speeds[[0, -1]],
            y=order * speeds[[0, -1]] / 60,
            mode="lines+text",
            text=["", f"EO {order}"],
            textposition="middle right",
            textfont={"size": 11, "color": MUTED},
            name="engine orders",
            legendgroup="orders",
            showlegend=i == 0,
            cliponaxis=False,
            hoverinfo="skip",
            line={"color": MUTED, "width": 1, "dash": "dash"},
        )
        figure.add_scatter(
            x=np.array([point.speed_rpm for point in own]),
            y=np.array([point.frequency_hz for point in own]),
            mode="markers",
            name=f"EO {order}",
            showlegend=False,
            customdata=sizes * scale.factor,
            marker={
                "size": _SMALLEST + (_LARGEST - _SMALLEST) * np.sqrt(sizes / top),
                "color": sizes * scale.factor,
                "colorscale": _SCALE,
                "cmin": 0.0,
                "cmax": top * scale.factor,
                "showscale": i == 0,
                "opacity": 0.85,
                "line": {"width": 0.5, "color": INK},
                "colorbar": {
                    "title": {"text": scale.unit, "side": "right"},
                    "x": 1.0,
                    "y": 0.0,
                    "yanchor": "bottom",
                    "len": 0.5,
                },
            },
            hovertemplate=f"EO {order}: %{{customdata:.5g}} {scale.unit} at %{{x:.6g}} rpm, %{{y:.6g}} Hz<extra></extra>",
        )
    shaded = _shade_operation(figure, view)
    styled(figure, 640)
    width = float(np.ptp(speeds))
    figure.update_xaxes(
        title_text="speed (rpm)",
        range=[speeds[0] - 0.01 * width, speeds[-1] + 0.07 * width],
        exponentformat="none",
        separatethousands=True,
    )
    figure.update_yaxes(title_text="frequency (Hz), rotating frame", range=[max(span[0] - pad, 0.0), span[1] + pad])
    caption = (
        f"Amplitude of {view.output_name} along {counted(len(found.lines), 'engine order')}: size and colour of the circles; the largest is "
        f"{quantity(top, 'm')}. Each point has the stiffness, the contact state and the static preload of its own speed. Lines: natural "
        f"frequencies of the waves that the engine orders excite, with all contacts stuck (solid) and open (dotted).{shaded}"
    )
    return Plot(f"run_up{view.key}", "Campbell diagram with the response", caption, figure)


def _shade_operation(figure: go.Figure, view: RunUpView) -> str:
    """Shade the operating range; return the sentence for the caption, empty for none."""
    own = view.found.operating
    if not own.known:
        return ""
    shade(figure, own.lowest, own.highest, along="x" if own.unit == "rpm" else "y")
    return f" Shaded: the {own.name}."


def amplitudes(view: RunUpView) -> Plot:
    """Draw the amplitude of each engine order over the speed."""
    scale = scale_for(view.amplitude(view.found.points), "m")
    figure = go.Figure()
    for i, line in enumerate(view.found.lines):
        order = line.engine_order
        own = view.found.along(line)
        figure.add_scatter(
            x=np.array([point.speed_rpm for point in own]),
            y=scale.factor * view.amplitude(own),
            mode="lines+markers",
            name=f"EO {order}",
            customdata=100 * np.array([point.slipping for point in own]),
            line={"color": colour(i), "width": 1.6},
            marker={"size": 4},
            hovertemplate=f"EO {order}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} rpm, %{{customdata:.0f}} % of the contacts slip<extra></extra>",
        )
    shaded = _shade_operation(figure, view) if view.found.operating.unit == "rpm" else ""
    styled(figure, 480)
    figure.update_xaxes(title_text="speed (rpm)", exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text=f"amplitude of {view.output_name} ({scale.unit})", rangemode="tozero")
    caption = f"Amplitude over speed, a line an engine order; points without a solution are left out.{shaded}"
    return Plot(f"run_up_amplitude{view.key}", "Amplitude over speed", caption, figure)


def fast(view: RunUpView) -> Plot | None:
    """Draw fast run-ups and the steady response."""
    found = view.found
    if not found.fast:
        return None
    scale = scale_for(view.amplitude(found.points), "m")
    figure = go.Figure()
    for i, line in enumerate(found.lines):
        order, own = line.engine_order, found.along(line)
        figure.add_scatter(
            x=np.array([point.speed_rpm for point in own]),
            y=scale.factor * view.amplitude(own),
            mode="lines",
            name=f"EO {order}, steady",
            line={"color": colour(i), "width": 2.2},
            hovertemplate=f"EO {order}, steady: %{{y:.5g}} {scale.unit} at %{{x:.6g}} rpm<extra></extra>",
        )
        for j, swept in enumerate(one for one in found.fast if one.engine_order == order):
            name = f"EO {order}, {swept.rate:g} rpm/s"
            figure.add_scatter(
                x=swept.speed_rpm,
                y=scale.factor * swept.amplitude,
                mode="lines",
                name=name,
                line={"color": colour(i), "width": 1.2, "dash": BROKEN[j % len(BROKEN)]},
                hovertemplate=f"{name}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} rpm<extra></extra>",
            )
    styled(figure, 480)
    figure.update_xaxes(title_text="speed (rpm)", exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text=f"amplitude of {view.output_name} ({scale.unit})", rangemode="tozero")
    known = [one.ratio for one in found.fast if np.isfinite(one.ratio)]
    told = f": the smallest peak is {number(100 * min(known), 4)} % of the steady one" if known else ""
    caption = f"Amplitude while the speed changes at a constant rate, beside the steady motion{told}. Contact forces follow the momentary amplitude. Beats behind a peak are less certain than the peak."
    return Plot(f"run_up_fast{view.key}", "Fast run-up", caption, figure)


def fast_peaks(view: RunUpView) -> Table | None:
    """Return a table of the peaks of fast run-ups."""
    if not view.found.fast:
        return None
    rows = [
        [
            str(swept.engine_order),
            number(swept.rate, 6),
            quantity(swept.peak_amplitude, "m", 5),
            number(swept.ratio, 4),
            number(swept.peak_speed_rpm, 6),
            number(swept.shift_rpm, 4),
            percent(100 * swept.neglected),
        ]
        for swept in view.found.fast
    ]
    head = ["engine order", "rpm/s", "peak", "of the steady one", "at rpm", "shift in rpm", "left out"]
    return Table(head, rows, "Peaks of fast run-ups")


def static_forces(view: RunUpView) -> Plot:
    """Draw the static normal force of the contacts over the speed."""
    rpm, force = view.found.static_speed_rpm, view.found.lines[0].static_normal_n
    figure = go.Figure(go.Scatter(x=rpm, y=force, mode="lines+markers", line={"color": colour(0)}, showlegend=False))
    styled(figure, 360)
    figure.update_xaxes(title_text="speed (rpm)", exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text="normal force of all contacts (N)")
    caption = (
        "Static normal force under the loads of each speed, summed over the contacts (of a wheel: of one sector), at the speeds at which the "
        "model was assembled."
    )
    return Plot(f"run_up_static{view.key}", "Static normal force over speed", caption, figure)


def peaks(view: RunUpView) -> Table:
    """Return a table of the peaks."""
    rows = []
    for line in view.found.lines:
        top = view.found.peak(line)
        rows.append(
            [
                str(line.engine_order),
                str(line.wave_number),
                quantity(line.peak_amplitude, "m", 5),
                number(line.peak_speed_rpm, 6),
                number(line.peak_frequency_hz, 6),
                percent(np.nan if top is None else 100 * top.slipping),
                quantity(np.nan if top is None else top.dissipated_w, "W"),
                str(line.failed),
                "" if line.peak_inside else "at an end of the range",
            ]
        )
    head = ["engine order", "wave", "peak", "rpm", "Hz", "contacts that slip", "dissipated", "failed points", ""]
    return Table(head, rows, "Peaks")


def _cards(view: RunUpView) -> list[Card]:
    known = [line for line in view.found.lines if np.isfinite(line.peak_amplitude)]
    if not known:
        return []
    top = max(known, key=lambda line: line.peak_amplitude)
    note = f"engine order {top.engine_order} at {number(top.peak_speed_rpm, 5)} rpm"
    first = Card(quantity(top.peak_amplitude, "m"), "largest amplitude of the run-up", note)
    own = view.found.operating
    met = [Met(f"engine order {li.engine_order}", li.engine_order, li.peak_speed_rpm) for li in known if li.peak_inside]
    operating = answered(own, met, "peak")
    largest = max(size for size, _ in map(view.found.largest_in_operation, known))
    told = f"; largest amplitude there {quantity(largest, 'm')}" * bool(np.isfinite(largest))
    # peaks of a response, whose place no other card answers
    return [first, *(replace(card, note=card.note + told, question="") for card in operating)]


_NEEDS = ("engine_orders", "speed_rpm", "amplitude", "stuck_hz")
_BLOCK = Block("run_up", "Run-up", (campbell_with_response, amplitudes, peaks, fast, fast_peaks, static_forces))
SECTION: Section = Section("run_up", _NEEDS, RunUpView, (_BLOCK,), by_case=True, cards=_cards)
