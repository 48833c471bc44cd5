"""Comparison of designs: results and measured curves side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from stickslip.analyses.compared.designs import Design, MeasuredCurve, differences, per_force, read_curve
from stickslip.analyses.compared.side_by_side import comparison_html, contents, peak_rows, peaks, unit_of
from stickslip.api.figures import Backend, plotted
from stickslip.api.result import Result
from stickslip.api.study import Study
from stickslip.api.table import as_text
from stickslip.errors import InputError, input_error, together
from stickslip.report.frame import write_page
from stickslip.report.plot import Plot
from stickslip.report.result import RESULT
from stickslip.study.store.folder import JOBS

Compared = str | Path | Result
STUDY = "study.toml"  # file name in the folder of a study
_FOLDER = "results"  # default folder of the results


@dataclass(frozen=True, eq=False)
class Comparison:
    """Designs compared with each other.

    Parameters
    ----------
    designs
        Designs in the order given; the first is the reference of the others.
    curves
        Responses of measurements or of other programs.
    """

    designs: tuple[Design, ...]
    curves: tuple[MeasuredCurve, ...] = ()

    def __post_init__(self) -> None:
        """Refuse results that cannot be compared."""
        per_force(self.designs, self.curves)

    @cached_property
    def _contents(self) -> dict[str, list[object]]:
        return {key: list(own) for key, _, own in contents(self.designs, self.curves)}

    @cached_property
    def _figures(self) -> dict[str, go.Figure]:
        every = (own for chapter in self._contents.values() for own in chapter)
        return {own.key: own.figure for own in every if isinstance(own, Plot)}

    @property
    def plots(self) -> tuple[str, ...]:
        """Names of the figures."""
        return tuple(self._figures)

    def plot(self, name: str, ax: Any = None, backend: Backend = "plotly") -> Any:
        """Return a figure of plotly, or draw it by matplotlib; `Result.plot` has the arguments and errors."""
        return plotted(self._figures, name, ax, backend, None, "comparison")

    @property
    def peaks(self) -> pd.DataFrame:
        """One row a case and design: the peak, its difference from the first design (NaN if it lacks the case), and utilisation with [stress]."""
        divided = per_force(self.designs, self.curves)
        found = peak_rows(self.designs, divided=divided)
        if not found:
            return pd.DataFrame()
        columns = {
            "case": "case",
            "design": "design",
            "frequency (Hz)": "hz",
            f"amplitude ({unit_of(self.designs, divided=divided)})": "height",
            "verdict": "level",
            "against the first (%)": "off_percent",
            "shift (Hz)": "shift_hz",
        }
        if any(not np.isnan(row.utilisation) for row in found):
            columns["utilisation"] = "utilisation"
        return pd.DataFrame({n: np.array([getattr(row, own) for row in found]) for n, own in columns.items()})

    @property
    def inputs(self) -> pd.DataFrame:
        """Keys of the study files that differ: one row a key, one column a design."""
        head, rows = ["key", *(d.name for d in self.designs)], differences(self.designs)
        columns = zip(*rows, strict=True) if rows else [() for _ in head]
        return pd.DataFrame({n: np.array(own) for n, own in zip(head, columns, strict=True)})

    def peaks_in_words(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        """Return headings and cells of the table of peaks, with units as on the page."""
        found = peaks(self.designs, divided=per_force(self.designs, self.curves))
        return ((), ()) if found is None else (found.head, found.rows)

    @property
    def same(self) -> bool:
        """Whether the designs have the same inputs and the same peaks."""
        if len(self.designs) < 2 or self.curves or len(self.inputs) or not len(self.peaks):
            return False
        off = self.peaks["against the first (%)"].to_numpy()
        return bool(np.isfinite(off).any() and np.nanmax(np.abs(off)) == 0.0)

    def report(self, path: str | Path = "comparison.html") -> Path:
        """Write the page; return its path."""
        target = Path(path)
        write_page(comparison_html(self.designs, self.curves), target)
        return target

    def __repr__(self) -> str:
        names = ", ".join(d.name for d in self.designs)
        return f"Comparison of {names}\n{as_text(self.peaks)}"


def compare(*compared: Compared, names: Sequence[str] = ()) -> Comparison:
    """Compare designs: their peaks, responses, optimisation curves, modes and inputs.

    Parameters
    ----------
    compared
        Results; or result files, folders or study files whose results are there; or CSV files with the columns ``frequency_hz`` and
        ``amplitude_um`` (``_mm``, ``_m``; ``_um_per_n`` …) of a measurement or another program. At least two, one of them a result.
    names
        Names for legends and tables, one for each of `compared`; left out: their folders, files or titles.

    Raises
    ------
    InputError
        If something cannot be read, nothing can be compared, or two names are equal.
    """
    given = _all_opened(compared)
    results = [own for own in given if isinstance(own, Result)]
    if len(given) < 2 or not results:
        raise input_error(
            f"compare({', '.join(map(str, compared))})",
            f"has {len(results)} results and {len(given) - len(results)} curves",
            "Give two results at least, or a result and a CSV file.",
        )
    labels = list(names) or _names(compared)
    if len(labels) != len(given) or len(set(labels)) != len(labels):
        raise input_error(
            f"names = {labels}", f"are no {len(given)} names that differ", "Give one for each that is compared."
        )
    designs: list[Design] = []
    curves: list[MeasuredCurve] = []
    for label, own in zip(labels, given, strict=True):
        if isinstance(own, Result):
            designs.append(Design(label, own.data, len(designs)))
        else:
            curves.append(MeasuredCurve(label, own.hz, own.amplitude, own.per_force))
    return Comparison(tuple(designs), tuple(curves))


def _all_opened(compared: Sequence[Compared]) -> list[Result | MeasuredCurve]:
    """Return the results and curves to compare; one error names all that cannot be read."""
    given: list[Result | MeasuredCurve] = []
    errors: list[InputError] = []
    for own in compared:
        try:
            given.append(_opened(own))
        except InputError as error:
            errors.append(error)
    if errors:
        raise together(errors)
    return given


def _opened(given: Compared) -> Result | MeasuredCurve:
    if isinstance(given, Result):
        return given
    path = Path(given)
    if path.suffix.lower() == ".csv":
        return read_curve(path)
    if path.suffix == ".toml":
        return _of_study(path)
    if path.is_dir() and not (path / RESULT).is_file() and (path / _FOLDER / RESULT).is_file():
        return Result.from_file(path / _FOLDER)
    if path.is_dir() and not (path / RESULT).is_file() and (path / STUDY).is_file():
        return _of_study(path / STUDY)
    if not path.exists():
        raise input_error(
            str(path), "does not exist", "Give a result, the folder of a study that was run, or a CSV file."
        )
    return Result.from_file(path)


def _of_study(path: Path) -> Result:
    """Return the result of a study file."""
    folder = Study.from_file(path).folder
    if not (folder / RESULT).is_file():
        begun = "its run has not ended yet" if (folder / JOBS).is_dir() else "it was not run"
        raise input_error(str(path), f"has no result, {begun}", f"Run it first: stickslip run {path}.")
    return Result.from_file(folder)


def _name_of(path: Path) -> str:
    """Return the name of the folder of a study, for its file, its result, or the folder of its results."""
    folder = path.parent if path.name in (RESULT, STUDY) and path.parent.name else path
    if folder.name == _FOLDER and folder.parent.name:
        folder = folder.parent
    return folder.stem if folder == path and path.suffix in (".nc", ".toml", ".csv") else folder.name


def _names(compared: Sequence[Compared]) -> list[str]:
    """Return unique names from folders, files or titles, with as much of the path as needed."""
    found = []
    for own in compared:
        if isinstance(own, Result):
            found.append(str(own.data.attrs.get("title", "")) or "result")
        else:
            found.append(_name_of(Path(own)))
    twice = len(set(found)) < len(found)
    if twice:
        found = [
            str(own) if isinstance(own, str | Path) else f"{name} {k + 1}"
            for k, (own, name) in enumerate(zip(compared, found, strict=True))
        ]
    return found
