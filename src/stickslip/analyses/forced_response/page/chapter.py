"""Forced responses on the page."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page import tables
from stickslip.analyses.forced_response.page.bifurcations import bifurcations
from stickslip.analyses.forced_response.page.contacts.bodies import bodies, energy
from stickslip.analyses.forced_response.page.contacts.contact import chosen_case, hysteresis_t, hysteresis_w, state_map
from stickslip.analyses.forced_response.page.contacts.surface import surface_map
from stickslip.analyses.forced_response.page.curves import (
    abscissa,
    frequency_response,
    low_order,
    most,
    optimisation,
    what_is_needed,
    where_friction_works,
)
from stickslip.analyses.forced_response.page.errors import error_scatter, errors
from stickslip.analyses.forced_response.page.harmonics import choice, kept_harmonics
from stickslip.analyses.forced_response.page.head import cards
from stickslip.analyses.forced_response.page.not_periodic import amplitudes_in_time, statistics_in_time
from stickslip.analyses.forced_response.page.response import NEEDED, Response
from stickslip.analyses.forced_response.page.wheel import (
    blades,
    peaks_of_blades,
    statistics,
    wheel_at_peak,
    wheel_in_motion,
)
from stickslip.analyses.forced_response.stability.stable_words import FEW, all_lines
from stickslip.analyses.forced_response.summary import orders_sentence, several_orders
from stickslip.report.content import Table, Words
from stickslip.report.plot import Plot, log_ticks, styled
from stickslip.report.quantities import NONE, fixed, number, scale_for
from stickslip.report.section import Block, Section
from stickslip.response.stability.modulus import modulus_text

BY_MOTION = ", the motion in time being "  # in the sentence of a point whose multipliers leave it undecided
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def stability(response: Response) -> list[Table | Words]:
    """Return a table with one row an examined point: verdict and multiplier."""
    names = [f"stability_{word}" for word in ("case", "frequency_hz", "verdict", "multiplier", "multiplier_error")]
    if not response.has(*names):
        return []
    case = response.integers(names[0])
    hz, size, error = (response.floats(name) for name in (names[1], *names[3:]))
    verdict = [str(text) for text in response.data[names[2]].values]
    told_each = response.has("stability_sentence")
    told = response.labels_of("stability_sentence") if told_each else [""] * len(verdict)
    by = ["motion in time" if BY_MOTION in text else "multiplier" for text in told]
    rows = [
        [
            response.cases[int(case[i])].short,
            fixed(float(hz[i]), 3),
            verdict[i],
            by[i] if verdict[i] in ("stable", "unstable") else NONE,
            modulus_text(float(size[i])) if np.isfinite(size[i]) else NONE,
            _error(float(error[i])),
        ]
        for i in range(len(verdict))
    ]
    text = (
        "Whether a small disturbance of the motion dies. Each is multiplied by so much in a period; above 1 by more "
        "than its error a machine does not stay there. Where the error reaches 1 the motion in time decides, or nothing does."
    )
    head = ["frequency (Hz)", "verdict", "decided by", "largest multiplier", "its error"]
    lines = all_lines(response.data, [c.label for c in response.cases]) if told_each else ()
    if len(rows) > FEW:
        every = response.table("", (), head, rows, folded=f"All {len(rows)} points")
        return [Words((text,), "Stability", lines), every]
    return [response.table("Stability", (text,), head, rows, items=lines)]


def _error(error: float) -> str:
    """Write the error of a multiplier; empty if no force acts on more harmonics."""
    if not np.isfinite(error):
        return "not known"
    return number(error, 2) if error > 0.0 else "none"


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


SECTION: Section = Section(
    "forced_response",
    NEEDED,
    Response,
    (
        Block("response", "Forced response", (frequency_response, of_each_order)),
        Block("optimisation", "Optimisation curves", (optimisation, where_friction_works, what_is_needed)),
        Block("wheel", "Blades of the wheel", (blades, peaks_of_blades, wheel_at_peak, wheel_in_motion, statistics)),
        Block(
            "contact",
            "Contacts at the peak",
            (chosen_case, state_map, surface_map, hysteresis_t, hysteresis_w, energy, bodies),
        ),
        Block("cases", "Cases", (tables.peaks,)),
        Block(
            "checks",
            "Checks",
            (
                stability,
                bifurcations,
                amplitudes_in_time,
                statistics_in_time,
                tables.time_integration,
                tables.retention,
            ),
        ),
        Block(
            "harmonics",
            "Harmonics: where more were needed, and what they cost",
            (choice, kept_harmonics, errors, error_scatter, low_order, tables.more_harmonics, tables.attempts),
            folded=True,
        ),
    ),
    cards=cards,
)
