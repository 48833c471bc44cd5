"""What every page of results is made of: numbered figures, sections, and the frame around them."""

import json
from html import escape
from pathlib import Path

from plotly.offline import get_plotlyjs

from stickslip.errors import input_error
from stickslip.report.page_style import SCRIPT, STYLE
from stickslip.report.plot import Plot
from stickslip.report.result import Case

_CONFIG = {
    "responsive": True,
    "displaylogo": False,
    "modeBarButtonsToRemove": ["select2d", "lasso2d"],
    # the camera saves pictures for print: twice the size on the screen
    "toImageButtonOptions": {"scale": 2},
}


def _show_case(plot: Plot, case: Case) -> None:
    """Hide the traces that belong to other load cases, for a reader without scripts and for the first view."""
    if plot.figure is not None and plot.case_captions:
        for trace in plot.figure.data:
            trace.visible = trace.meta is None or trace.meta == case.index


def figure_html(plot: Plot, number: int, chosen: Case | None = None) -> str:
    """Return a figure with its number and caption.

    Parameters
    ----------
    plot
        What to draw.
    number
        Of the figure in the page.
    chosen
        The load case that is shown first, None where there is no choice.
    """
    captions = "".join(
        f'<span data-case="{index}"{"" if chosen and index == chosen.index else " hidden"}> {text}</span>'
        for index, text in plot.case_captions.items()
    )
    label = f"<b>Figure {number}. {escape(plot.title)}.</b> "
    caption = f"<figcaption>{label}{plot.caption}{captions}</figcaption>"
    if plot.figure is None:
        return f'<figure id="fig-{plot.key}" class="absent">{caption}</figure>'
    if chosen:
        _show_case(plot, chosen)
    drawing = plot.figure.to_html(
        full_html=False, include_plotlyjs=False, div_id=f"plot-{plot.key}", config=_CONFIG
    )
    kind = "by-case" if plot.case_captions else "all-cases"
    return f'<figure id="fig-{plot.key}" class="{kind}">{plot.controls}{drawing}{caption}</figure>'


def section(name: str, title: str, body: str) -> str:
    """Return a section with its heading."""
    return f'<section id="{name}"><h2>{title}</h2>{body}</section>'


def versions(stored: str) -> dict[str, str]:
    """Return the versions of libraries from the JSON that results hold."""
    try:
        found = json.loads(stored)
    except json.JSONDecodeError:
        return {"versions": stored}
    return {str(k): str(v) for k, v in found.items()} if isinstance(found, dict) else {}


def page_html(title: str, made: str, body: str, *, style: str = "", script: str = "") -> str:
    """Return a whole page, which needs neither network nor other files.

    Parameters
    ----------
    title, made
        Its heading and the line below it, plain text.
    body
        HTML.
    style, script
        Added to those of all pages.
    """
    title, made = escape(title), escape(made)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{STYLE}{style}</style><script>{get_plotlyjs()}</script></head>"
        f'<body><main><header><h1>{title}</h1><p class="made">{made}</p></header>{body}</main>'
        f"<script>{SCRIPT}{script}</script></body></html>\n"
    )


def write_page(page: str, path: Path) -> None:
    """Write a page; an `InputError` says why it cannot be."""
    try:
        path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise input_error(
            str(path),
            f"cannot be written ({error.strerror})",
            "Choose a folder that exists and is writable.",
        ) from error
