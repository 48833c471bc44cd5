"""The report: one HTML page that needs neither network nor our package."""

import json
from collections.abc import Callable
from html import escape
from pathlib import Path

from plotly.offline import get_plotlyjs

from stickslip.errors import input_error
from stickslip.report import tables
from stickslip.report.figure_mesh import mesh_picture
from stickslip.report.figures_contact import hysteresis, state_map
from stickslip.report.figures_damper import damper, energy
from stickslip.report.figures_error import error_scatter, errors
from stickslip.report.figures_response import frequency_response, low_order, optimisation
from stickslip.report.page_style import SCRIPT, STYLE
from stickslip.report.plot import Plot
from stickslip.report.result import RATIO, Case, Result, load_result
from stickslip.report.summary import alert, headline, warnings_box

_RESPONSE: tuple[Callable[[Result], Plot], ...] = (
    frequency_response,
    low_order,
    errors,
    error_scatter,
    optimisation,
)
_CONFIG = {
    "responsive": True,
    "displaylogo": False,
    "modeBarButtonsToRemove": ["select2d", "lasso2d"],
}


def _show_case(plot: Plot, case: Case) -> None:
    """Hide the traces that belong to other load cases, for a reader without scripts and for the first view."""
    if plot.figure is not None and plot.case_captions:
        for trace in plot.figure.data:
            trace.visible = trace.meta is None or trace.meta == case.index


def _figure_html(plot: Plot, number: int, chosen: Case | None) -> str:
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
    return f'<figure id="fig-{plot.key}" class="{kind}">{drawing}{caption}</figure>'


def _chooser(result: Result, chosen: Case | None) -> str:
    """Buttons that choose the load case of the contact figures."""
    if chosen is None:
        return ""
    buttons = "".join(
        f'<button type="button" data-case="{c.index}" aria-pressed="{str(c is chosen).lower()}">'
        f'<i style="background:{c.colour}"></i>{c.label}</button>'
        for c in result.peaked
    )
    return f'<nav class="chooser" aria-label="load case"><span>Load case {RATIO}:</span>{buttons}</nav>'


def _section(name: str, title: str, body: str) -> str:
    return f'<section id="{name}"><h2>{title}</h2>{body}</section>'


def _versions(result: Result) -> dict[str, str]:
    try:
        stored = json.loads(result.text("versions", "{}"))
    except json.JSONDecodeError:
        return {"versions": result.text("versions")}
    return {str(k): str(v) for k, v in stored.items()} if isinstance(stored, dict) else {}


def _body(result: Result) -> str:
    chosen = result.peaked[-1] if result.peaked else None
    contact = [
        hysteresis(result, "t"),
        hysteresis(result, "w"),
        state_map(result),
        damper(result),
        energy(result),
    ]
    plots = [figure(result) for figure in _RESPONSE], contact, [mesh_picture(result)]
    drawn, count = [], 0
    for group in plots:
        drawn.append(
            "".join(_figure_html(plot, count + k + 1, chosen) for k, plot in enumerate(group))
        )
        count += len(group)
    checks = f"<h3>Time integration</h3>{tables.verification(result)}<h3>Retention</h3>{tables.retention(result)}"
    sections = (
        _section("alert", "Where more harmonics were needed", alert(result)),
        _section("response", "Forced response", drawn[0]),
        _section("contact", "Contact and damper at the peak", _chooser(result, chosen) + drawn[1]),
        _section("model", "Model", f"{drawn[2]}<h3>Reduction</h3>{tables.reduction(result)}"),
        _section("cases", "Load cases", tables.load_cases(result)),
        _section("checks", "Checks", checks),
        _section("provenance", "Provenance", tables.provenance(result, _versions(result))),
    )
    return headline(result) + warnings_box(result) + "".join(sections)


def report_html(result: Result) -> str:
    """Return the whole page."""
    title = escape(result.text("title", "Forced response"))
    made = escape(f"stickslip {result.text('stickslip_version')} · {result.text('created')}")
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{STYLE}</style><script>{get_plotlyjs()}</script></head>"
        f'<body><main><header><h1>{title}</h1><p class="made">{made}</p></header>{_body(result)}</main>'
        f"<script>{SCRIPT}</script></body></html>\n"
    )


def write_report(dataset_path: Path, html_path: Path) -> None:
    """Write the report of a result as one self-contained HTML page.

    Parameters
    ----------
    dataset_path
        netCDF-4 file of ``stickslip run``, finished or not.
    html_path
        The page to write; its folder must exist.
    """
    page = report_html(load_result(dataset_path))
    try:
        html_path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise input_error(
            str(html_path),
            f"cannot be written ({error.strerror})",
            "Choose a folder that exists and is writable.",
        ) from error
