"""Working range of the friction: the ends of the optimisation curves in words, and a band behind them."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.verdicts.working_range import MIN_PEAKS, working_ranges
from stickslip.analyses.forced_response.verdicts.working_words import TITLE, range_lines
from stickslip.report.cases import first_number
from stickslip.report.content import Words
from stickslip.report.plot import GRID


def where_friction_works(response: Response) -> Words | None:
    """Say where all contacts stick, where friction works, and where it lets go."""
    lines = range_lines(response.data)
    if not lines:
        return None
    return Words(heading=TITLE, items=lines)


def what_is_needed(response: Response) -> Words | None:
    """Say what optimisation curves need where a number is varied with too few values."""
    key, n = first_number(response.data)[0], len(response.cases)
    if not key or n >= MIN_PEAKS:
        return None
    text = f"Curves over {key}, and where friction works, need {MIN_PEAKS} values or more; there are {n}. Add values to [vary]."
    return Words((text,))


def shade_working_range(figure: go.Figure, response: Response, *, logarithmic: bool) -> str:
    """Draw a band over each stretch of values at which friction works; return what the caption says of it, nothing where none is drawn."""
    ranges = working_ranges(response.data)
    stretches = ranges[0].stretches if len(ranges) == 1 and ranges[0].judged else []
    if not stretches:
        return ""
    values = np.unique([p.value for p in ranges[0].peaks])
    middles = np.sqrt(values[1:] * values[:-1]) if logarithmic else (values[1:] + values[:-1]) / 2
    edges = np.array([values[0], *middles, values[-1]])
    for stretch in stretches:
        at = np.searchsorted(values, sorted(p.value for p in stretch))
        figure.add_vrect(
            x0=float(edges[at[0]]),
            x1=float(edges[at[-1] + 1]),
            fillcolor=GRID,
            opacity=0.6,
            line_width=0,
            layer="below",
        )
    return " Shaded, to halfway to the neighbouring cases: where friction works."
