"""A figure for a paper as a file: vectors, with a width in the units of a journal, in the style of `rcParams`."""

import math
import re
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

from stickslip.errors import input_error
from stickslip.report.paper.figure import draw, require_matplotlib
from stickslip.study.store.atomic_write import unwritable

INCHES = {"mm": 1 / 25.4, "cm": 1 / 2.54, "in": 1.0, "pt": 1 / 72.27}
LEAST_WIDTH, MOST_WIDTH = 20 / 25.4, 1000 / 25.4  # inches
FORMATS = ("pdf", "svg", "eps", "png")
_LENGTH = re.compile(r"\s*([0-9.]+)\s*([a-z]+)\s*")
# settings for a column of a journal; the user's style is applied after them
STYLE: Any = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "legend.title_fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.5,
    "legend.frameon": False,
    "pdf.fonttype": 42,  # text stays editable
    "ps.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "stickslip",  # the same file from the same result
}
# files hold no date, so that the same result gives the same bytes
_NO_DATE = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}


def inches(length: str) -> float:
    """Return a length such as ``85mm``, ``8.5cm``, ``3.35in`` or ``242pt`` (TeX's points) in inches.

    Raises
    ------
    InputError
        If the text is no length, or the length no possible width of a figure.
    """
    found = _LENGTH.fullmatch(length)
    try:
        size = float(found[1]) * INCHES[found[2]] if found else math.nan
    except (KeyError, ValueError):
        size = math.nan
    if not LEAST_WIDTH <= size <= MOST_WIDTH:
        remedy = "Give 20mm to 1000mm, such as 85mm, 8.5cm, 3.35in or 242pt."
        raise input_error("figure: width", f"is {length!r}", remedy)
    return size


def write_figure(figure: go.Figure, name: str, path: Path, width: str, style: str = "") -> None:
    """Write a figure of the page for a paper.

    Parameters
    ----------
    figure, name
        The figure and its name.
    path
        The file; its ending is the format: pdf, svg, eps or png.
    width
        Width, see `inches`.
    style
        A style of matplotlib, by name or file, whose fonts, sizes and colours of axes override `STYLE`; empty for none.

    Raises
    ------
    InputError
        If the format, the width or the style is unknown, the figure is a solid, or the file cannot be written.
    StickslipError
        If matplotlib is not installed.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        what = f"ends with {path.suffix!r}" if kind else "has no ending"
        raise input_error(f"figure: {path}", what, f"Give one of .{', .'.join(FORMATS)}.")
    wide = inches(width)
    require_matplotlib()
    from matplotlib import rc_context
    from matplotlib import style as styles

    with ExitStack() as settings:
        settings.enter_context(rc_context(STYLE))
        if style:
            try:
                settings.enter_context(styles.context(style))
            except OSError:
                remedy = "Give a file of rcParams, or a name of matplotlib.style.available."
                raise input_error("figure: style", f"{style!r} is none", remedy) from None
        drawn = draw(figure, name, width=wide)
        try:
            drawn.savefig(path, metadata=_NO_DATE.get(kind), dpi=300)
        except OSError as error:
            raise unwritable(path, error) from None
