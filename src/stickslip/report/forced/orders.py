"""The amplitude of each engine order where several act at once."""

import numpy as np
import plotly.graph_objects as go

from stickslip.report.forced.curves import abscissa, most
from stickslip.report.plot import Plot, log_ticks, styled
from stickslip.report.quantities import number, scale_for
from stickslip.report.response import Response
from stickslip.study.analyses.forced_response.summary import orders_sentence, several_orders

DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def of_each_order(response: Response) -> Plot | None:
    """Draw the amplitude of each engine order over frequency or speed."""
    orders = several_orders(response.data)
    if not orders or not response.has("driven_amplitude"):
        return None
    size = response.at_outputs(response.values("driven_amplitude", "point", "driven", "output"))
    size = np.where(response.converged[:, None], size, np.nan)
    scale = scale_for(size, response.length)
    x, name, unit = abscissa(response)
    cases = most(response, np.nanmax(size, axis=1, initial=-np.inf))
    figure, said = go.Figure(), []
    for case in cases:
        at = response.points(case)
        for k, m in enumerate(orders):
            figure.add_scatter(
                x=x[at],
                y=size[at, k] * scale.factor,
                mode="lines",
                name=f"engine order {m}",
                legendgroup=str(case.index),
                legendgrouptitle={"text": case.label or None},
                line={"color": case.colour, "width": 1.8, "dash": DASHES[k % len(DASHES)]},
                hovertemplate=f"{case.named}<br>engine order {m}<br>%{{x:.2f}} {unit}: %{{y:.4g}} {scale.unit}<extra></extra>",
            )
            if np.isfinite(size[at, k]).any():
                top = at[int(np.nanargmax(size[at, k]))]
                said.append(
                    f"engine order {m} {number(float(size[top, k]) * scale.factor)} {scale.unit} at {number(float(x[top]), 5)} {unit}{case.where}"
                )
    styled(figure, 440)
    figure.update_xaxes(title_text=f"{name} ({unit})")
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", type="log", **log_ticks(size * scale.factor))
    text = (
        f"Each engine order in {response.output_name}; the curve above is their norm. {orders_sentence(response.data)}"
    )
    largest = f" Largest: {'; '.join(said)}." if said else ""
    return Plot("orders", "Amplitude of each engine order", text + largest, figure)
