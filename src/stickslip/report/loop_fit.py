"""The page of a fit to hysteresis loops: measurement, fitted law, and residual."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.contact.loop_fit import LoopFit
from stickslip.report.frame import Chapter, Placing, page_html, write_page
from stickslip.report.plot import COLOURS, MUTED, Plot, legend_above, styled
from stickslip.report.quantities import counted, number, scale_for
from stickslip.report.section import Content, Words

MOST_DRAWN = 20_000  # samples of a recording: more are thinned out


def loop_figure(fit: LoopFit) -> go.Figure:
    """Draw force over displacement, measured and fitted, and the residual in the order of time."""
    length = scale_for(np.concatenate([x for x, _ in fit.loops]), "m")
    newton = scale_for(np.concatenate([f for _, f in fit.loops]), "N")
    figure = make_subplots(1, 2, horizontal_spacing=0.12, column_widths=[0.58, 0.42])
    begin = 0
    for j, ((x, force), fitted) in enumerate(zip(fit.loops, fit.fitted, strict=True)):
        every = slice(None, None, 1 + x.size // MOST_DRAWN)
        own = {"legendgroup": str(j), "showlegend": j == 0}
        dots = {"mode": "markers", "marker": {"size": 4, "color": MUTED}, **own}
        figure.add_scatter(
            x=x[every] * length.factor, y=force[every] * newton.factor, name="measured", row=1, col=1, **dots
        )
        figure.add_scatter(
            x=x[every] * length.factor,
            y=fitted[every] * newton.factor,
            name="fitted",
            mode="lines",
            line={"width": 2, "color": COLOURS[j % len(COLOURS)]},
            row=1,
            col=1,
            **own,
        )
        at = (begin + np.arange(x.size))[every]
        left = (force - fitted)[every] * newton.factor
        figure.add_scatter(x=at, y=left, name="residual", row=1, col=2, **(dots | {"showlegend": False}))
        begin += x.size
    styled(figure, 480)
    legend_above(figure)
    figure.update_xaxes(title_text=f"displacement ({length.unit})", col=1)
    figure.update_xaxes(title_text="sample", col=2)
    figure.update_yaxes(title_text=f"force ({newton.unit})", col=1)
    figure.update_yaxes(title_text=f"measured − fitted ({newton.unit})", col=2)
    return figure


def write_loop_page(fit: LoopFit, source: Path, target: Path, estimates: Sequence[str], lines: Sequence[str]) -> None:
    """Write the page of a fit.

    Parameters
    ----------
    fit
        The fit.
    source
        File of the loops.
    target
        The page; its folder must exist.
    estimates, lines
        Estimates, and lines for a study file, as shown on the terminal.
    """
    n = counted(sum(x.size for x, _ in fit.loops), "sample")
    caption = f"Left are the measured loop and the law along its displacements. Right are the residuals, with a standard deviation of {number(fit.residual)} N over {n}."
    placing = Placing()

    def own(key: str, title: str, content: Content) -> Chapter:
        return Chapter(key, title, placing([content]))

    drawing = Plot("loops", "Hysteresis loop and fit", caption, loop_figure(fit))
    chapters = [
        own("estimates", "Estimates", Words(preformatted="\n".join(estimates))),
        own("loops", "Loop and fit", drawing),
    ]
    if fit.notes:
        notes = Words(items=[f"{note}." for note in fit.notes])
        chapters.append(own("notes", "Not identified by these loops, or doubtful", notes))
    chapters.append(own("study", "For the study file", Words(preformatted="\n".join(lines))))
    write_page(page_html("Friction contact from measured loops", source.name, chapters), target)
