"""The page of a bladed disk: nodal-diameter map, mode shapes, Campbell and SAFE diagrams of one model."""

from collections.abc import Mapping
from pathlib import Path

from stickslip.report import wheel_tables as tables
from stickslip.report.figure_campbell import campbell_diagram
from stickslip.report.figure_diameters import diameter_map, safe_diagram
from stickslip.report.figure_shapes import mode_shapes
from stickslip.report.page_parts import figure_html, page_html, section, write_page
from stickslip.report.shapes_script import SCRIPT, STYLE
from stickslip.report.wheel_result import WheelResult, load_wheel


def wheel_html(results: Mapping[str, WheelResult]) -> str:
    """Return the whole page of results of one model, command -> result."""
    first = next(iter(results.values()))
    sections, count = [], 0
    for command, result in results.items():
        body = []
        plots = {
            "modes": (diameter_map, mode_shapes),
            "campbell": (campbell_diagram,),
            "safe": (safe_diagram,),
        }[command]
        for plot in plots:
            count += 1
            body.append(figure_html(plot(result), count))
        sections.append(section(command, _TITLES[command], "".join(body) + _table(command, result)))
    sections.append(section("model", "Model", tables.model_facts(first)))
    sections.append(section("provenance", "Provenance", tables.provenance(results)))
    newest = max(results.values(), key=lambda r: r.text("created"))
    made = f"stickslip {newest.text('stickslip_version')} · {newest.text('created')}"
    body_html = tables.cards(results) + tables.notes(results) + "".join(sections)
    return page_html(
        newest.text("title", "Bladed disk"), made, body_html, style=STYLE, script=SCRIPT
    )


def write_wheel_report(path: Path, html_path: Path) -> None:
    """Write the page of the results of bladed disks in a folder.

    Parameters
    ----------
    path
        ``modes.nc``, ``campbell.nc``, ``safe.nc`` or a folder that holds some of them; what belongs to another model
        is left out.
    html_path
        The page to write; its folder must exist.
    """
    write_page(wheel_html(load_wheel(path)), html_path)


_TITLES = {
    "modes": "Natural frequencies and mode shapes",
    "campbell": "Frequencies against speed",
    "safe": "Interference with engine orders",
}


def _table(command: str, result: WheelResult) -> str:
    if command == "campbell":
        return f"<h3>Crossings</h3>{tables.crossings(result)}"
    if command == "safe":
        return f"<h3>Engine orders and the modes that they can excite</h3>{tables.interference(result)}"
    found = f"<h3>Natural frequencies</h3>{tables.frequencies(result)}"
    if result.has("difference"):
        found += f"<h3>Against the reference</h3>{tables.comparison(result)}"
    return found
