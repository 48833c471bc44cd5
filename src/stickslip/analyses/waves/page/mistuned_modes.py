"""Modes of a wheel whose sectors differ on the page: in which blades each mode lives, and of which waves it is made."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.waves.page.waves import Waves
from stickslip.report.plot import INK, Plot, legend_above, styled
from stickslip.report.quantities import number


def modes_of_wheel(view: Waves) -> Plot | None:
    """Draw the localisation of each mode, and its shares of the blades and of the waves."""
    if not view.has("mistuned_hz", "sector_share", "wave_share"):
        return None
    hertz, blades = view.floats("mistuned_hz"), view.floats("sector_share")
    factor, waves = view.floats("mode_localisation"), view.floats("wave_share")
    figure = make_subplots(
        1,
        3,
        horizontal_spacing=0.08,
        column_widths=[0.3, 0.35, 0.35],
        subplot_titles=("localisation factor", "share of each blade", "share of each wave"),
    )
    modes = np.arange(1, hertz.size + 1)
    figure.add_bar(
        x=factor,
        y=modes,
        orientation="h",
        marker_color=INK,
        customdata=hertz,
        showlegend=False,
        hovertemplate="mode %{y}, %{customdata:.6g} Hz: %{x:.3f}<extra></extra>",
        row=1,
        col=1,
    )
    for column, share, name in ((2, blades, "blade"), (3, waves, "wave number")):
        figure.add_trace(
            go.Heatmap(
                z=100 * share,
                y=modes,
                x=np.arange(share.shape[1]),
                colorscale="Blues",
                showscale=column == 3,
                colorbar={"title": {"text": "%"}},
                zmin=0,
                customdata=np.tile(hertz[:, None], share.shape[1]),
                hovertemplate=f"mode %{{y}}, %{{customdata:.6g}} Hz<br>{name} %{{x}}: %{{z:.2g}} %<extra></extra>",
            ),
            row=1,
            col=column,
        )
    styled(figure, max(380, min(12 * hertz.size + 160, 900)))
    legend_above(figure)
    figure.update_yaxes(title_text="mode", col=1)
    figure.update_xaxes(range=[0, 1], col=1)
    figure.update_xaxes(title_text="blade", col=2)
    figure.update_xaxes(title_text="wave number", col=3)
    most = int(np.argmax(factor))
    text = (
        f"{hertz.size} modes of all sectors together, {number(float(hertz.min()), 6)} to {number(float(hertz.max()), 6)} Hz: the share of the "
        "kinetic energy that each blade and each wave has. With all sectors alike every mode is one wave. The most localised one is mode "
        f"{most + 1} ({number(float(hertz[most]), 6)} Hz): factor {number(float(factor[most]), 3)} (0: all blades alike, 1: one alone), blade "
        f"{int(np.argmax(blades[most]))}."
    )
    return Plot(f"wheel_modes{view.key}", "Modes of the wheel whose sectors differ", text, figure)
