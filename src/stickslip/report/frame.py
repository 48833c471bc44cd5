"""What every page is made of: numbered figures, chapters, boxes, and the frame around them."""

from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from plotly.offline import get_plotlyjs

from stickslip.report.plot import Plot
from stickslip.report.section import Card
from stickslip.study.analyses.verdict import Verdict, worst_first
from stickslip.study.keep.whole import write_whole

_CONFIG = {
    "responsive": True,
    "displaylogo": False,
    "modeBarButtonsToRemove": ["select2d", "lasso2d"],
    # the camera saves pictures for print: twice the size on the screen
    "toImageButtonOptions": {"scale": 2},
}


def figure_html(plot: Plot, number: int) -> str:
    """Return a figure with its number in the page and its caption."""
    captions = "".join(
        f'<span data-case="{index}"{"" if index == plot.chosen else " hidden"}> {text}</span>'
        for index, text in plot.case_captions.items()
    )
    caption = f"<figcaption><b>Figure {number}. {escape(plot.title)}.</b> {plot.caption}{captions}</figcaption>"
    drawing = plot.figure.to_html(
        full_html=False, include_plotlyjs=False, div_id=f"plot-{plot.key}", config=_CONFIG
    )
    kind = "by-case" if plot.case_captions else "all-cases"
    ends = [axis.domain[1] for axis in plot.figure.select_xaxes() if axis.domain]
    if min(ends, default=1.0) < 0.9 or len(list(plot.figure.select_scenes())) > 1:
        # panels beside each other scroll on a narrow screen
        drawing = f'<div class="wide panels">{drawing}</div>'
    return f'<figure id="fig-{plot.key}" class="{kind}">{plot.controls}{drawing}{caption}</figure>'


def chapter(key: str, title: str, body: str) -> str:
    """Return a chapter with its heading."""
    return f'<section id="{key}"><h2>{title}</h2>{body}</section>'


def cards_html(cards: Sequence[Card]) -> str:
    """Return the boxes at the top."""
    boxes = "".join(
        f'<div class="card{" danger" * c.danger}"><b>{c.value}</b><span>{c.label}</span><small>{c.note}</small></div>'
        for c in cards
    )
    return f'<div class="cards">{boxes}</div>' if boxes else ""


def verdicts_html(verdicts: Sequence[Verdict], told: str, *, bad: bool) -> str:
    """Return what is not trusted, why, and what to do, the worst first; folded below it what is trusted.

    Parameters
    ----------
    verdicts
        All of a result.
    told
        The conclusion, as the last line of a run says it.
    bad
        Whether a case or an analysis is not trusted.
    """
    every = worst_first(verdicts)
    shown = [v for v in every if v.told]
    good = [v for v in every if not v.told]
    kind = "bad" if bad else "some" if any(v.rank or v.warns for v in shown) else "good"
    items = f"<ul>{''.join(map(_verdict, shown))}</ul>" if shown else ""
    top = f'<div class="box {kind}"><b>{escape(told)}</b>{items}</div>'
    if not good:
        return top
    rest = "".join(map(_verdict, good))
    return f"{top}<details><summary>Trusted, and what for: {len(good)}</summary><ul>{rest}</ul></details>"


def _verdict(verdict: Verdict) -> str:
    remedy = f" <i>{escape(verdict.remedy)}</i>" if verdict.remedy else ""
    word = f'<b class="{verdict.word}">{verdict.word.upper()}:</b>'
    return f"<li>{word} {escape(verdict.finding)}{remedy}</li>"


def page_html(title: str, made: str, body: str) -> str:
    """Return a whole page, which needs neither network nor other files.

    Parameters
    ----------
    title, made
        Its heading and the line below it, plain text.
    body
        HTML.
    """
    title, made = escape(title), escape(made)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{_asset('page.css')}</style><script>{get_plotlyjs()}</script></head>"
        f'<body><main><header><h1>{title}</h1><p class="made">{made}</p></header>{body}</main>'
        f"<script>{_asset('page.js')}{_asset('shapes.js')}</script></body></html>\n"
    )


def _asset(name: str) -> str:
    return files("stickslip.report").joinpath("assets", name).read_text(encoding="utf-8")


def write_page(page: str, path: Path) -> None:
    """Write a page whole or not at all; an `InputError` says why it cannot be."""
    write_whole(path, page.encode("utf-8", errors="replace"))
