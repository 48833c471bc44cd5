"""Figures by name: for the screen by plotly, for papers by matplotlib."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args

import plotly.graph_objects as go

from stickslip.errors import did_you_mean, input_error
from stickslip.report.paper.figure import draw, on_paper

Backend = Literal["plotly", "matplotlib"]


def plotted(figures: Mapping[str, go.Figure], name: str, ax: Any, backend: Backend, case: int | None, of: str) -> Any:
    """Return a figure of plotly or matplotlib, or the axes that it was drawn in; see `Result.plot`.

    Parameters
    ----------
    figures
        Figures of the page by name.
    name, ax, backend, case
        As in `Result.plot`.
    of
        Name of the owner of the figures, for errors.
    """
    if name not in figures:
        raise input_error(f"plot({name!r})", f"is no figure of this {of}", did_you_mean(name, list(figures)))
    if backend not in get_args(Backend):
        raise input_error("plot: backend", f"is {backend!r}", f"Give one of {', '.join(get_args(Backend))}.")
    figure = figures[name] if case is None else _of_case(figures[name], name, case)
    if ax is None and backend == "plotly":
        return figure
    return draw(figure, name, ax)


def _of_case(figure: go.Figure, name: str, case: int) -> go.Figure:
    """Return a copy of a figure that shows one case, where the page has buttons for it."""
    cases = sorted({trace.meta for trace in figure.data if isinstance(trace.meta, int)})
    if case not in cases:
        known = f"Give one of {', '.join(map(str, cases))}." if cases else "Leave it out: the figure shows all cases."
        raise input_error(f"plot({name!r}): case", f"is {case}", known)
    own = go.Figure(figure)
    for trace in own.data:
        trace.visible = trace.meta is None or trace.meta == case
    return own


def export_figure(result: Path, name: str, to: Path | None, width: str, style: str, case: int | None) -> Path:
    """Write a figure of a result file for a paper; return the file.

    Parameters
    ----------
    result
        The file, or the folder that holds it.
    name
        Name of the figure; for an unknown or empty one the error lists all.
    to
        The file; None: ``NAME.pdf`` in the current folder.
    width, style
        See `stickslip.report.paper.figure.write_figure`.
    case
        The case shown where the page has buttons for it; None: as on the page.

    Raises
    ------
    InputError
        If there is no such figure, or it cannot be drawn or written.
    """
    from stickslip.analyses.page import plots
    from stickslip.report.paper.figure import write_figure
    from stickslip.report.result import open_result

    figures = plots(open_result(result))
    flat = [own for own, figure in figures.items() if on_paper(figure)]
    if name not in figures:
        what = f"{name!r} is none of this result" if name else "no name is given"
        raise input_error("figure", what, _remedy(name, flat))
    target = Path(f"{name}.pdf") if to is None else to
    write_figure(figures[name] if case is None else _of_case(figures[name], name, case), name, target, width, style)
    return target


def _remedy(name: str, known: list[str]) -> str:
    near = did_you_mean(name, known) if name else ""
    listed = f"Figures: {', '.join(known)}." if known else "It has none."
    return f"{near} {listed}" if near.startswith("Did") else listed
