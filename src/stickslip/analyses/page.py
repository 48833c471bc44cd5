"""The page of a result: one HTML file of all analyses, which needs neither network nor this package."""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from stickslip.analyses import pictures
from stickslip.analyses.inputs import inputs, study_of
from stickslip.analyses.nonlinear_mode import page as nonlinear_mode
from stickslip.analyses.residual_tractions.page import with_bands
from stickslip.analyses.waves.page import waves
from stickslip.analyses.waves.page.modes import with_resonance
from stickslip.errors import input_error
from stickslip.report.cases import cases_of
from stickslip.report.frame import CaseBody, Chapter, Placing, concluded, page_html, write_page
from stickslip.report.plot import Plot
from stickslip.report.quantities import NONE, fixed, number, quantity
from stickslip.report.result import Node, analysis, open_result, versions
from stickslip.report.section import Block, Card, Content, Part, Section, Table, Words, chooser
from stickslip.study.file.case_names import CASE
from stickslip.study.questions import ANALYSES, OWN_ANALYSIS, loaded
from stickslip.study.store.netcdf import alike, one_case
from stickslip.study.verdict import conclusion, not_trusted, of_tree

FORCED = "forced_response"  # its figures show bounds over residual tractions, if the result has them
MODES = "modes"  # its shapes open on a mode that another analysis finds resonant


def _shown(tree: xr.DataTree) -> Iterator[tuple[Section, xr.Dataset]]:
    """Yield the sections whose analysis is in the result, each with its dataset."""
    for name, home in ANALYSES.items():
        if name not in tree.children or not home.page:
            continue
        section: Section = loaded(home.page)
        data = analysis(tree, name)
        data = with_bands(data, tree) if name == FORCED else with_resonance(data, tree) if name == MODES else data
        if all(name in data for name in section.needs) and data.sizes.get("case"):
            yield section, data
    for name in tree.children:
        if name not in ANALYSES:
            data = analysis(tree, str(name))
            yield _own_section(str(name), data), data


def _own_section(name: str, data: xr.Dataset) -> Section:
    """Return the section of a user's analysis: ``SECTION`` of its module, or else a table of its numbers.

    A module that this process has not imported stays so: a result alone runs no code.
    """
    module = sys.modules.get(str(data.attrs.get(OWN_ANALYSIS, "")).partition(":")[0])
    section = getattr(module, "SECTION", None)
    if isinstance(section, Section) and all(variable in data for variable in section.needs):
        return section
    return Section(name, (), Node, (Block(name, name.replace("_", " ").capitalize(), (_numbers,)),), by_case=True)


def _numbers(view: Node) -> list[Table]:
    """Return tables of the variables of a case: its single values, and one table for each dimension."""
    found: dict[str, list[str]] = {}
    for variable, values in view.data.data_vars.items():
        if values.ndim <= 1 and values.size and str(variable) not in ("case_label", "vary_value"):
            found.setdefault(str(values.dims[0]) if values.ndim else "", []).append(str(variable))
    return [_of_dimension(view.data, dimension, names) for dimension, names in found.items()]


def _of_dimension(data: xr.Dataset, dimension: str, names: Sequence[str]) -> Table:
    told = [data[name].attrs for name in names]
    units = [f" ({own['units']})" if own.get("units", "1") != "1" else "" for own in told]
    head = [f"{own.get('long_name', name)}{unit}" for own, name, unit in zip(told, names, units, strict=True)]
    columns = [[_shown_value(v) for v in np.atleast_1d(data[name].values).tolist()] for name in names]
    return Table(head, [list(row) for row in zip(*columns, strict=True)], dimension.replace("_", " ").capitalize())


def _shown_value(value: object) -> str:
    return number(value, 6) if isinstance(value, int | float) else str(value)


def _views(section: Section, data: xr.Dataset) -> list[Any]:
    """Return the views of a section: all cases at once, or one after the other; equal cases share the first view."""
    if not section.by_case:
        return [section.view(data)]
    n = data.sizes["case"]
    drawn = range(n) if len(alike(data)) > 1 else [0]
    each = [one_case(data, k) for k in drawn] if n > 1 else [data.isel(case=0)]
    views = [section.view(own.assign_attrs(drawn_cases=len(each))) for own in each]
    return [views[0], *(replace(view, key=f"_{k}") for k, view in enumerate(views[1:], 1))]


def _contents(parts: Sequence[Part], view: Any) -> Iterator[Content]:
    """Yield the contents of the parts of a chapter for a view."""
    for part in parts:
        shown = part(view)
        if isinstance(shown, Sequence):
            yield from shown
        elif shown is not None:
            yield shown


Viewed = tuple[Section, xr.Dataset, Sequence[Any]]  # a section, its dataset, and its views


def _answer(shown: Sequence[Viewed]) -> Plot | None:
    """Return the figure at the top of the page, from the first section; None if each case has its own figure."""
    for section, _, (first, *others) in shown[:1]:
        parts = section.answer or tuple(part for block in section.blocks for part in block.parts)
        figures = (own for own in _contents(parts, first) if isinstance(own, Plot))
        return None if others else next(figures, None)
    return None


def _answering_first(shown: Sequence[Viewed]) -> list[Viewed]:
    """Return the sections, with the first one that yields to no other in front."""
    names = {section.name for section, _, _ in shown}
    first = [own for own in shown if not names & set(own[0].yields_to)][:1]
    return [*first, *(own for own in shown if own not in first)]


def _cards(section: Section, data: xr.Dataset, views: Sequence[Any]) -> list[Card]:
    """Return the numbers of a section for the top of the page; if cases differ, of the first case, with its name."""
    own = section.cards(views[0])
    case = str(data["case_label"].values[0]) if len(views) > 1 else ""
    return [replace(card, note="; ".join(filter(None, (card.note, case)))) for card in own]


def one_a_question(cards: Sequence[Card]) -> list[Card]:
    """Return the cards; of several with the same question the one with the least margin, at the place of the first."""
    least = {card.question: card for card in sorted(cards, key=lambda card: -card.margin)}
    own = [least[card.question] if card.question else card for card in cards]
    return [card for k, card in enumerate(own) if not card.question or card not in own[:k]]


def _chapter(viewed: Viewed, block: Block, placing: Placing, above: Plot | None) -> Chapter | None:
    """Return a chapter for all cases, or one for each case with buttons; None for an empty one. The figure `above` is not drawn again."""
    section, data, views = viewed
    bodies = [
        placing(own for own in _contents(block.parts, view) if above is None or getattr(own, "key", "") != above.key)
        for view in views
    ]
    if all(placed.kind == "chooser" for body in bodies for placed in body):  # buttons that choose nothing
        return None
    if len(bodies) == 1:
        n = data.sizes["case"] if section.by_case else 1
        same = [Words((f"The same in all {n} cases.",))] if n > 1 else []
        return Chapter(block.key, block.title, [*placing(same), *bodies[0]], folded=block.folded)
    cases = cases_of(data)
    buttons = chooser(CASE, cases, 0)
    each = [CaseBody(k, case.label, body) for k, (case, body) in enumerate(zip(cases, bodies, strict=True))]
    return Chapter(block.key, block.title, placing([buttons] if buttons else []), each, block.folded)


def _nodes(tree: xr.DataTree) -> dict[str, Node]:
    return {section.name: _views(section, data)[0] for section, data in _shown(tree)}


def _provenance(tree: xr.DataTree) -> list[Content]:
    """Return versions, date and study file of the result."""
    node = Node(tree.to_dataset())
    used = versions(node.text("versions", "{}"))
    rows = [
        ["created", node.text("created", NONE)],
        ["stickslip", node.text("stickslip_version", NONE)],
        *([name, used[name]] for name in used if name != "stickslip"),
        ["wall time", quantity(node.scalar("wall_seconds"), "s")],
    ]
    for section, data in _shown(tree):
        own = Node(data)
        if own.text("selection"):
            rows.append([f"{section.name}: harmonics", f"chosen by {own.text('selection')}"])
            rows.append([f"{section.name}: samples per period", fixed(own.scalar("samples"), 0)])
    study, table = node.text("study_toml"), Table((), rows, numeric=False)
    return [table, Words(folded="The study file", preformatted=study)] if study else [table]


def plots(tree: xr.DataTree) -> dict[str, go.Figure]:
    """Return every figure by its name, in the order of the page."""
    found: list[Content] = []
    for section, data in _shown(tree):
        parts = [part for block in section.blocks for part in block.parts]
        for view in _views(section, data):
            found += _contents(parts, view)
    found += _contents((nonlinear_mode.over_responses, pictures.picture), _nodes(tree))
    return {own.key: own.figure for own in found if isinstance(own, Plot)}


def report_html(tree: xr.DataTree) -> str:
    """Return the whole page as HTML.

    Parameters
    ----------
    tree
        A result: one node an analysis, provenance in the attributes of the root. Missing parts are left out.
    """
    shown = [(section, data, _views(section, data)) for section, data in _shown(tree)]
    placing, nodes = Placing(), {section.name: views[0] for section, _, views in shown}
    root = Node(tree.to_dataset())
    ranked = _answering_first(shown)
    above = _answer(ranked)
    figure = placing([*([above] if above else []), *_contents((waves.states,), nodes)])
    cards = one_a_question([card for own in ranked for card in _cards(*own)])
    each = (_chapter(own, block, placing, above) for own in shown for block in own[0].blocks)
    chapters = [chapter for chapter in each if chapter is not None]
    body = placing(_contents((nonlinear_mode.over_responses,), nodes))
    chapters += [Chapter("backbones", "Responses and modes", body)] if body else []
    chapters = sorted(chapters, key=lambda chapter: chapter.folded)
    drawing = pictures.picture(nodes)
    given = placing([*([drawing] if drawing else []), *inputs(study_of(root), nodes)])
    facts = placing(_contents(pictures.PARTS, nodes))
    for key, title, body in (("inputs", "What was computed", given), ("model", "Model", facts)):
        chapters += [Chapter(key, title, body, folded=True)] if body else []
    chapters.append(Chapter("provenance", "Provenance", placing(_provenance(tree)), folded=True))
    made = f"stickslip {root.text('stickslip_version')} · {root.text('created')}"
    told = concluded(of_tree(tree), conclusion(tree), bad=bool(not_trusted(tree)))
    return page_html(root.text("title") or "Result", made, chapters, cards=cards, answer=figure, conclusion=told)


def write_report(tree: xr.DataTree, path: Path) -> None:
    """Write the page of a result; the folder of `path` must exist."""
    write_page(report_html(tree), path)


def report_file(path: Path, html_path: Path | None = None) -> Path:
    """Write the page of a result file; return its path.

    Parameters
    ----------
    path
        The file, or the folder that holds it.
    html_path
        The page to write; ``report.html`` beside the result if left out.
    """
    tree = open_result(path)
    if not any(True for _ in _shown(tree)):
        known = ", ".join(name for name, home in ANALYSES.items() if home.page)
        raise input_error(
            str(path), f"holds none of {known}", "This is no result of 'stickslip run'; run the study again."
        )
    target = html_path or (path if path.is_dir() else path.parent) / "report.html"
    write_report(tree, target)
    return target
