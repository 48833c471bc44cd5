"""The report: one HTML page that needs neither network nor our package."""

from collections.abc import Callable
from pathlib import Path

from stickslip.report import tables
from stickslip.report.attempts import attempts
from stickslip.report.choice import choice
from stickslip.report.figure_harmonics import kept_harmonics
from stickslip.report.figure_mesh import mesh_picture
from stickslip.report.figures_contact import hysteresis, state_map
from stickslip.report.figures_damper import damper, energy
from stickslip.report.figures_error import error_scatter, errors
from stickslip.report.figures_response import frequency_response, low_order, optimisation
from stickslip.report.page_parts import figure_html, page_html, section, versions, write_page
from stickslip.report.plot import Plot
from stickslip.report.result import RATIO, Case, Result, load_result
from stickslip.report.summary import headline, warnings_box

_RESPONSE: tuple[Callable[[Result], Plot], ...] = (
    frequency_response,
    low_order,
    kept_harmonics,
    errors,
    error_scatter,
    optimisation,
)


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
            "".join(figure_html(plot, count + k + 1, chosen) for k, plot in enumerate(group))
        )
        count += len(group)
    checks = (
        f"<h3>More harmonics</h3>{tables.reference(result)}"
        f"<h3>Time integration</h3>{tables.verification(result)}<h3>Retention</h3>{tables.retention(result)}"
    )
    sections = (
        section("alert", "Where more harmonics were needed", choice(result)),
        section("response", "Forced response", drawn[0]),
        section("contact", "Contact and damper at the peak", _chooser(result, chosen) + drawn[1]),
        section("model", "Model", f"{drawn[2]}<h3>Reduction</h3>{tables.reduction(result)}"),
        section("cases", "Load cases", tables.load_cases(result) + attempts(result)),
        section("checks", "Checks", checks),
        section(
            "provenance",
            "Provenance",
            tables.provenance(result, versions(result.text("versions", "{}"))),
        ),
    )
    return headline(result) + warnings_box(result) + "".join(sections)


def report_html(result: Result) -> str:
    """Return the whole page."""
    made = f"stickslip {result.text('stickslip_version')} · {result.text('created')}"
    return page_html(result.text("title", "Forced response"), made, _body(result))


def write_report(dataset_path: Path, html_path: Path) -> None:
    """Write the report of a result as one self-contained HTML page.

    Parameters
    ----------
    dataset_path
        netCDF-4 file of ``stickslip run``, finished or not.
    html_path
        The page to write; its folder must exist.
    """
    write_page(report_html(load_result(dataset_path)), html_path)
