"""Figures of a mistuned wheel: every blade over frequency, peaks of blades, the wheel at the peak and in motion, its waves."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.curves import abscissa
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.blades import BOUND
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import GRID, INK, MUTED, Plot, colour, legend_above, log_ticks, styled
from stickslip.report.quantities import number, percent, quantity, scale_for

GAP = "gap in m"  # end of the name of a deviation in metres; other deviations are relative
MIN_HISTOGRAM_CASES = 5  # least number of cases for a histogram of amplifications
BLADE = "rgba(0, 114, 178, 0.25)"


def mistuned(response: Response) -> bool:
    """Return whether the wheel is mistuned."""
    return response.blades[0].blade_peak_amplitude.size > 0 and bool(response.peaked)


def blades(response: Response) -> Plot | None:
    """Draw the amplitude of every blade over frequency, the largest amplitude, and the tuned wheel."""
    if not mistuned(response):
        return None
    size, count = response.fields.amplitude, response.blades[0].blade_peak_amplitude.size
    own = size.shape[1] // count
    size = size[:, response.outputs[0] % own :: own]
    size = np.where(response.converged[:, None], size, np.nan)
    scale = scale_for(size, response.length)
    x, name, unit = abscissa(response)
    figure, said = go.Figure(), {}
    for case in response.peaked:
        at = response.points(case)
        at = at[np.argsort(x[at], kind="stable")]
        gaps = np.full((count, 1), np.nan)
        every = np.hstack([size[at].T, gaps]).ravel() * scale.factor
        figure.add_scatter(
            x=np.tile(np.append(x[at], np.nan), count),
            y=every,
            mode="lines",
            name="each blade",
            line={"color": BLADE, "width": 1},
            hoverinfo="skip",
            meta=case.index,
        )
        figure.add_scatter(
            x=x[at],
            y=np.nanmax(size[at], axis=1) * scale.factor,
            mode="lines",
            name="largest blade",
            line={"color": INK, "width": 2.2},
            meta=case.index,
            customdata=np.nanargmax(np.nan_to_num(size[at], nan=-1.0), axis=1),
            hovertemplate=f"%{{x:.2f}} {unit}: blade %{{customdata}}, %{{y:.4g}} {scale.unit}<extra></extra>",
        )
        tuned = response.blades[case.index]
        order = np.argsort(tuned.tuned_frequency_hz, kind="stable")
        figure.add_scatter(
            x=tuned.tuned_frequency_hz[order] * _per_hz(response, x),
            y=tuned.tuned_amplitude[order] * scale.factor,
            mode="lines",
            name="all sectors alike",
            line={"color": colour(1), "width": 2, "dash": "dash"},
            meta=case.index,
        )
        said[case.index] = _amplified(response, case)
    styled(figure, 460)
    legend_above(figure)
    figure.update_xaxes(title_text=f"{name} ({unit})")
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", type="log", **log_ticks(size * scale.factor))
    text = f"The curves show the amplitude of every blade ({count} blades), the largest one at each frequency, and the wheel with all sectors alike."
    return Plot("blades", "Every blade of the wheel", text, figure, said, response.chosen)


def _per_hz(response: Response, x: FloatArray) -> float:
    """Return the factor from frequency (Hz) to the abscissa of a figure."""
    known = np.isfinite(x) & (response.hz > 0)
    return float(x[known][0] / response.hz[known][0]) if known.any() else 1.0


def _motion(response: Response) -> ComplexArray:
    """Return (case, blade) motion of the blades at the peak."""
    parts = np.array([own.blade_motion for own in response.blades])
    return np.asarray(parts[..., 0] + 1j * parts[..., 1])


def _amplified(response: Response, case: ShownCase) -> str:
    own = response.blades[case.index]
    return (
        f"Largest: blade {own.largest_blade}. Amplification {number(own.amplification, 4)} over the wheel with all sectors alike. "
        f"{BOUND} is {number(own.whitehead, 3)}."
    )


def peaks_of_blades(response: Response) -> Plot | None:
    """Draw the peak of each blade, and its deviation."""
    if not mistuned(response):
        return None
    scale = scale_for(np.array([own.blade_peak_amplitude for own in response.blades]), response.length)
    names = response.labels("mistuned") if response.blades[0].deviation.size else ()
    rows = 1 + len(names)
    figure = make_subplots(rows, 1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[2.0, *[1.0] * len(names)])
    numbers = np.arange(response.blades[0].blade_peak_amplitude.size)
    for case in response.peaked:
        own = response.blades[case.index]
        flat = own.tuned_peak_amplitude * scale.factor
        figure.add_bar(
            x=numbers,
            y=own.blade_peak_amplitude * scale.factor,
            name="peak of each blade",
            marker_color=colour(0),
            meta=case.index,
            customdata=own.blade_peak_hz,
            hovertemplate=f"blade %{{x}}: %{{y:.4g}} {scale.unit} at %{{customdata:.2f}} Hz<extra></extra>",
            row=1,
            col=1,
        )
        figure.add_scatter(
            x=[-0.5, numbers[-1] + 0.5],
            y=[flat, flat],
            mode="lines",
            name="all sectors alike",
            line={"color": colour(1), "dash": "dash"},
            meta=case.index,
            row=1,
            col=1,
        )
        for k, name in enumerate(names):
            factor = 1e6 if name.endswith(GAP) else 100
            figure.add_bar(
                x=numbers,
                y=factor * own.deviation[:, k],
                name=name,
                marker_color=colour(2 + k),
                meta=case.index,
                showlegend=False,
                row=2 + k,
                col=1,
            )
    styled(figure, 340 + 130 * len(names))
    legend_above(figure)
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", row=1)
    for k, name in enumerate(names):
        unit = "µm" if name.endswith(GAP) else "%"
        figure.update_yaxes(title_text=f"{name.removesuffix(', ' + GAP)} ({unit})", row=2 + k)
    figure.update_xaxes(title_text="blade", row=rows)
    text = "Largest amplitude of each blade at any frequency" + (", and its deviation." if names else ".")
    said = {c.index: _amplified(response, c) for c in response.peaked}
    return Plot("blade_peaks", "Peak of each blade", text, figure, said, response.chosen)


def wheel_at_peak(response: Response) -> Plot | None:
    """Draw all blades at the peak as a polar plot at two instants, with the amplitudes of the travelling waves."""
    if not mistuned(response):
        return None
    motion, waves = _motion(response), np.array([own.wave_amplitude for own in response.blades])
    scale = scale_for(np.abs(motion), response.length)
    figure = make_subplots(
        1, 2, specs=[[{"type": "polar"}, {"type": "xy"}]], column_widths=[0.5, 0.5], horizontal_spacing=0.14
    )
    said = {}
    count = motion.shape[1]
    angle = 360.0 * np.arange(count + 1) / count
    for case in response.peaked:
        own = motion[case.index]
        closed = np.append(own, own[0])
        figure.add_scatterpolar(
            r=np.abs(closed) * scale.factor,
            theta=angle,
            mode="lines+markers",
            name="amplitude",
            fill="toself",
            line={"color": colour(0)},
            meta=case.index,
            row=1,
            col=1,
        )
        top = own[int(np.argmax(np.abs(own)))]
        instant = np.real(closed * np.conj(top) / abs(top)) * scale.factor if abs(top) else 0 * angle
        figure.add_scatterpolar(
            r=np.abs(instant),
            theta=angle,
            mode="markers",
            name="at the instant of the largest blade",
            marker={"color": [colour(1) if v >= 0 else MUTED for v in instant], "size": 7},
            meta=case.index,
            row=1,
            col=1,
        )
        figure.add_bar(
            x=np.arange(count),
            y=waves[case.index] * scale.factor,
            name="waves",
            marker_color=colour(0),
            meta=case.index,
            customdata=np.minimum(np.arange(count), count - np.arange(count)),
            showlegend=False,
            hovertemplate=f"wave %{{x}} ({{%{{customdata}}}} nodal diameters): %{{y:.4g}} {scale.unit}<extra></extra>",
            row=1,
            col=2,
        )
        share = waves[case.index] ** 2
        main = int(np.argmax(share))
        said[case.index] = (
            f"Wave {main} ({min(main, count - main)} nodal diameters) carries {percent(100 * float(share[main] / (share.sum() or 1.0)))} of the sum of "
            f"squares; localisation factor {number(response.blades[case.index].localisation, 3)} (0: all alike, 1: one blade alone)."
        )
    styled(figure, 460)
    legend_above(figure)
    figure.update_polars(
        radialaxis={"gridcolor": GRID, "angle": 90, "ticksuffix": f" {scale.unit}", "nticks": 4},
        angularaxis={"gridcolor": GRID, "direction": "counterclockwise"},
    )
    figure.update_xaxes(title_text="wave number", col=2)
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", col=2)
    text = "The figure shows all blades at the peak, in the lowest harmonic that is driven. Left are the amplitudes around the wheel, right the waves that add up to them."
    return Plot("wheel", "The wheel at the peak", text, figure, said, response.chosen)


def statistics(response: Response) -> Plot | None:
    """Draw the distribution of the amplification, if there are enough cases, such as several seeds."""
    if not mistuned(response) or len(response.peaked) < MIN_HISTOGRAM_CASES:
        return None
    of_peaked = [response.blades[case.index] for case in response.peaked]
    factors, bound = np.array([own.amplification for own in of_peaked]), of_peaked[0].whitehead
    figure = go.Figure()
    figure.add_histogram(x=factors, marker_color=colour(0), name="cases")
    styled(figure, 380)
    figure.update_xaxes(title_text="amplification")
    figure.update_yaxes(title_text="cases")
    at = np.quantile(factors, [0.5, 0.95])
    text = (
        f"Amplification in {factors.size} cases: mean {number(float(factors.mean()), 4)}, median {number(float(at[0]), 4)}, 95 % below "
        f"{number(float(at[1]), 4)}, largest {number(float(factors.max()), 4)}. {BOUND} is {number(bound, 3)}."
    )
    return Plot("amplifications", "Amplification over all cases", text, figure)


HUB, TIP = 0.55, 1.0  # radii in the picture
REACH = 0.8  # largest lean of a blade as a share of the pitch
FRAMES = 24  # frames a period
MILLISECONDS = 60  # duration of a frame


def leaning(motion: ComplexArray, phase: float) -> tuple[FloatArray, FloatArray]:
    """Return lines (hub, tip, gap for each blade) of blades inclined by their motion at a phase of the period."""
    count = motion.size
    angle = 2 * np.pi * np.arange(count) / count
    lean = np.real(motion * np.exp(1j * phase)) / np.abs(motion).max() * REACH * 2 * np.pi / count
    at = np.column_stack([angle, angle + lean])
    radius = np.array([HUB, TIP])
    gap = np.full((count, 1), np.nan)
    return tuple(np.hstack([radius * f(at), gap]).ravel() for f in (np.cos, np.sin))  # type: ignore[return-value]


def wheel_in_motion(response: Response) -> Plot | None:
    """Draw all blades at the peak over a period, inclined by their motion."""
    if not mistuned(response):
        return None
    motion = _motion(response)
    cases = [c for c in response.peaked if np.abs(motion[c.index]).max() > 0]
    if not cases:
        return None
    own = [motion[c.index] * np.exp(-1j * _first(motion[c.index])) for c in cases]

    def lines(phase: float) -> list[go.Scatter]:
        found = []
        for case, one in zip(cases, own, strict=True):
            x, y = leaning(one, phase)
            line = {"color": colour(0), "width": 3}
            found.append(go.Scatter(x=x, y=y, mode="lines", line=line, meta=case.index, hoverinfo="skip"))
        return found

    ring = np.linspace(0, 2 * np.pi, 181)
    hub = go.Scatter(
        x=HUB * np.cos(ring), y=HUB * np.sin(ring), mode="lines", line={"color": GRID, "width": 6}, hoverinfo="skip"
    )
    figure = go.Figure([*lines(0.0), hub])
    moving = list(range(len(cases)))
    figure.frames = [go.Frame(data=lines(2 * np.pi * k / FRAMES), traces=moving, name=str(k)) for k in range(FRAMES)]
    styled(figure, 520)
    play = {"frame": {"duration": MILLISECONDS, "redraw": False}, "transition": {"duration": 0}, "fromcurrent": True}
    names = [str(k) for _ in range(20) for k in range(FRAMES)]
    stop = {"frame": {"duration": 0, "redraw": False}, "mode": "immediate"}
    figure.update_layout(
        showlegend=False,
        updatemenus=[
            {
                "type": "buttons",
                "direction": "left",
                "x": 0,
                "xanchor": "left",
                "y": 1.0,
                "yanchor": "bottom",
                "buttons": [
                    {"label": "play", "method": "animate", "args": [names, play]},
                    {"label": "stop", "method": "animate", "args": [[None], stop]},
                ],
            }
        ],
    )
    hidden = {"visible": False, "range": [-1.1, 1.1]}
    figure.update_xaxes(**hidden)
    figure.update_yaxes(**hidden, scaleanchor="x")
    text = (
        "Each line is a blade, which leans by its motion at the peak; the largest one by eight tenths of the distance to its neighbour. "
        "Blade 0 points to the right, numbers grow anticlockwise, in the sense of rotation. Play runs through twenty periods."
    )
    said = {
        c.index: f"Largest amplitude {quantity(float(np.abs(motion[c.index]).max()), response.length)}." for c in cases
    }
    return Plot("wheel_motion", "The blades in motion", text, figure, said, response.chosen)


def _first(motion: ComplexArray) -> float:
    """Return the phase at which the largest blade leans most, where the motion begins."""
    return float(np.angle(motion[int(np.argmax(np.abs(motion)))]))
