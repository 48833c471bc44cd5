"""The report: one HTML page of all analyses of a result, which needs neither network nor our package."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
import xarray as xr

from stickslip.errors import input_error
from stickslip.report import model
from stickslip.report.cases import cases_of, varied
from stickslip.report.forced.contact import case_buttons
from stickslip.report.forced.tractions import with_bands
from stickslip.report.frame import (
    cards_html,
    chapter,
    figure_html,
    page_html,
    verdicts_html,
    write_page,
)
from stickslip.report.node import Node
from stickslip.report.plot import Plot
from stickslip.report.quantities import NONE, fixed, quantity
from stickslip.report.result import analysis, open_result, versions
from stickslip.report.section import Card, Part, Section, Shown
from stickslip.report.sections import (
    all_motions,
    campbell,
    flutter,
    forced_response,
    limit_cycle,
    modal_synthesis,
    modes,
    nonlinear_mode,
    quasi_periodic,
    residual_tractions,
    resonance,
    run_up,
    safe,
)
from stickslip.report.tables import html_table
from stickslip.study.analyses.verdict import conclusion, not_trusted, of_tree
from stickslip.study.keep.netcdf import alike, one_case

SECTIONS: tuple[Section, ...] = (
    forced_response.SECTION,
    nonlinear_mode.SECTION,
    modal_synthesis.SECTION,
    quasi_periodic.SECTION,
    limit_cycle.SECTION,
    resonance.SECTION,
    all_motions.SECTION,
    residual_tractions.SECTION,
    modes.SECTION,
    campbell.SECTION,
    flutter.SECTION,
    safe.SECTION,
    run_up.SECTION,
)


def _shown(tree: xr.DataTree) -> Iterator[tuple[Section, xr.Dataset]]:
    """Return the sections whose analysis is in the result, with its dataset."""
    for section in SECTIONS:
        data = analysis(tree, section.name) if section.name in tree.children else xr.Dataset()
        data = with_bands(data, tree) if section.name == forced_response.SECTION.name else data
        if all(name in data for name in section.needs) and data.sizes.get("case"):
            yield section, data


def _views(section: Section, data: xr.Dataset) -> list[Any]:
    """Return what a section draws: all cases at once, or one after the other; the first for all where they are alike."""
    if not section.by_case:
        return [section.view(data)]
    n = data.sizes["case"]
    drawn = range(n) if len(alike(data)) > 1 else [0]
    each = [one_case(data, k) for k in drawn] if n > 1 else [data.isel(case=0)]
    views = [section.view(own) for own in each]
    return [views[0], *(replace(view, key=f"_{k}") for k, view in enumerate(views[1:], 1))]


def _as_list(shown: Shown) -> Sequence[Plot | str]:
    if shown is None:
        return ()
    return (shown,) if isinstance(shown, (Plot, str)) else shown


class _Numbered:
    """Draws parts, numbering the figures of a page."""

    def __init__(self) -> None:
        self._count = 0

    def html(self, parts: Sequence[Part], view: Any) -> str:
        """Return the parts of a chapter that the view holds."""
        return "".join(self._one(shown) for part in parts for shown in _as_list(part(view)))

    def _one(self, shown: Plot | str) -> str:
        if isinstance(shown, str):
            return shown
        self._count += 1
        return figure_html(shown, self._count)


def _by_case(section: Section, data: xr.Dataset, bodies: Sequence[str]) -> str:
    """Return the same chapter for each case, and the buttons that choose between them."""
    if len(bodies) == 1:
        n = data.sizes["case"] if section.by_case else 1
        return (f"<p>The same in all {n} cases.</p>" if n > 1 else "") + bodies[0]
    names = [f"<p><b>{c.label}</b></p>" if c.label else "" for c in cases_of(data)]
    each = "".join(
        f'<div data-case="{k}"{" hidden" if k else ""}>{name}{body}</div>'
        for k, (name, body) in enumerate(zip(names, bodies, strict=True))
    )
    return (case_buttons(varied(data), cases_of(data), 0) or "") + each


def _nodes(tree: xr.DataTree) -> dict[str, Node]:
    return {section.name: _views(section, data)[0] for section, data in _shown(tree)}


def _provenance(tree: xr.DataTree) -> str:
    """Who made this, with what, from which study."""
    node = Node(tree.to_dataset())
    used = versions(node.text("versions", "{}"))
    rows = [
        ["created", escape(node.text("created", NONE))],
        ["stickslip", escape(node.text("stickslip_version", NONE))],
        *([escape(name), escape(used[name])] for name in used if name != "stickslip"),
        ["wall time", quantity(node.scalar("wall_seconds"), "s")],
    ]
    for section, data in _shown(tree):
        own = Node(data)
        if own.text("selection"):
            chosen, samples = escape(own.text("selection")), fixed(own.scalar("samples"), 0)
            rows.append([f"{section.name}: harmonics", f"chosen by {chosen}"])
            rows.append([f"{section.name}: samples per period", samples])
    study, text = escape(node.text("study_toml")), html_table([], rows, numeric=False)
    more = f"<details><summary>The study file</summary><pre>{study}</pre></details>"
    return text + more if study else text


def plots(tree: xr.DataTree) -> dict[str, go.Figure]:
    """Return every figure of the page by its name, in the order of the page."""
    found: list[Plot | str | None] = []
    for section, data in _shown(tree):
        parts = [part for block in section.blocks for part in block.parts]
        for view in _views(section, data):
            found += [shown for part in parts for shown in _as_list(part(view))]
    nodes = _nodes(tree)
    found += [nonlinear_mode.over_responses(nodes), model.picture(nodes)]
    return {plot.key: plot.figure for plot in found if isinstance(plot, Plot)}


def report_html(tree: xr.DataTree) -> str:
    """Return the whole page.

    Parameters
    ----------
    tree
        A result: a node an analysis, provenance in the attributes of the root. What is missing is left out.
    """
    numbered, chapters = _Numbered(), []
    cards: list[Card] = []
    for section, data in _shown(tree):
        views = _views(section, data)
        cards += section.cards(views[0])
        for block in section.blocks:
            bodies = [numbered.html(block.parts, view) for view in views]
            if any(bodies):
                chapters.append(chapter(block.key, block.title, _by_case(section, data, bodies)))
    nodes = _nodes(tree)
    body = numbered.html((nonlinear_mode.over_responses,), nodes)
    chapters += [chapter("backbones", "Responses and modes", body)] if body else []
    body = numbered.html(model.PARTS, nodes)
    chapters += [chapter("model", "Model", body)] if body else []
    chapters.append(chapter("provenance", "Provenance", _provenance(tree)))
    root = Node(tree.to_dataset())
    made = f"stickslip {root.text('stickslip_version')} · {root.text('created')}"
    top = cards_html(cards) + verdicts_html(
        of_tree(tree), conclusion(tree), bad=bool(not_trusted(tree))
    )
    return page_html(root.text("title") or "Result", made, top + "".join(chapters))


def write_report(tree: xr.DataTree, path: Path) -> None:
    """Write the page of a result; the folder of `path` must exist."""
    write_page(report_html(tree), path)


def report_file(path: Path, html_path: Path | None = None) -> Path:
    """Write the page of a result file; return where it is.

    Parameters
    ----------
    path
        The file, or the folder that holds it.
    html_path
        The page to write; ``report.html`` beside the result if left out.
    """
    tree = open_result(path)
    if not any(True for _ in _shown(tree)):
        known = ", ".join(section.name for section in SECTIONS)
        raise input_error(
            str(path),
            f"holds none of {known}",
            "This is no result of 'stickslip run'; run the study again.",
        )
    target = html_path or (path if path.is_dir() else path.parent) / "report.html"
    write_report(tree, target)
    return target
