"""A result in Python: data, figures, peaks, page."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go
import xarray as xr

from stickslip.analyses.page import plots, write_report
from stickslip.api.export import Format, Wanted, export_result
from stickslip.api.figures import Backend, plotted
from stickslip.api.screen import by_default
from stickslip.api.table import dataframe
from stickslip.assembly.model import Model
from stickslip.errors import did_you_mean, input_error
from stickslip.report.result import RESULT, open_result
from stickslip.study.coordinates import selectable
from stickslip.study.outcome import Outcome
from stickslip.study.store.netcdf import write_tree
from stickslip.study.verdict import LEVELS, Verdict, conclusion, not_trusted, of_tree

WITH_PEAKS = ("forced_response", "modes", "safe")  # analyses for which `Result.peaks` has a table


@dataclass(frozen=True, eq=False)
class Result:
    """The answers of a study or a model.

    Parameters
    ----------
    data
        A DataTree with a dataset for each analysis, in Hz and SI units; provenance in the attributes of the root.
    path
        The file; None for a result in memory.
    files
        All files that the run wrote.
    failed
        Number of points without a solution.
    """

    data: xr.DataTree
    path: Path | None = None
    files: tuple[Path, ...] = ()
    failed: int = 0

    @classmethod
    def from_file(cls, path: str | Path) -> "Result":
        """Read a result file, or the result in a folder."""
        path = Path(path)
        return cls(open_result(path), path / RESULT if path.is_dir() else path)

    @classmethod
    def open(cls, path: str | Path) -> "Result":
        """Read a result as `from_file` does; deprecated."""
        warnings.warn("Result.open goes with 0.3: Result.from_file does the same", DeprecationWarning, stacklevel=2)
        return cls.from_file(path)

    def __getitem__(self, name: str) -> xr.Dataset:
        """Return the dataset of an analysis; ``.sel(force_n=5)`` takes the points, or cases, with a value of a varied key.

        Raises
        ------
        InputError
            If the result has none of that name.
        """
        if name not in self.data.children:
            raise input_error(f"result[{name!r}]", "is no analysis of this result", did_you_mean(name, list(self)))
        return selectable(self.data[name].to_dataset())

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the analyses, in the order of the file, as over the keys of a dictionary."""
        return (str(name) for name in self.data.children)

    def to_dataframe(self, name: str = "", of: str = "") -> pd.DataFrame:
        """Return an analysis as a table of pandas, in Hz and SI units, which `DataFrame.attrs` names.

        Parameters
        ----------
        name
            Name of the analysis; left out: the first of the result.
        of
            Variable with one entry a row; variables over the same dimensions become further columns. Left out: amplitude, damping or
            frequency.

        Raises
        ------
        InputError
            If there is no such analysis or variable.
        """
        name = name or next(iter(self), "")
        return dataframe(self[name], name, of)

    def save(self, path: str | Path) -> Path:
        """Write the result as netCDF-4; return the file.

        Parameters
        ----------
        path
            The file, such as ``out.nc``, or a folder that exists.

        Raises
        ------
        InputError
            If it is neither, or cannot be written.
        """
        path = Path(path)
        target = path / RESULT if path.is_dir() else path
        if not target.suffix:
            raise input_error(
                str(path),
                "is no folder that exists, and a file's name has an ending",
                f"Give {path}.nc, or make the folder first: it gets a {RESULT}.",
            )
        write_tree(self.data, target)
        return target

    def export(  # noqa: PLR0913
        self,
        to: Format = "vtu",
        folder: str | Path | None = None,
        *,
        case: int = 0,
        hz: float | None = None,
        steps: int = 24,
        wheel: bool = False,
        units: str = "SI",
        of: Model | str | Path | None = None,
        analysis: str = "",
        number: int = 0,
        amplitude_mm: float | None = None,
    ) -> tuple[Path, ...]:
        """Write the motion of every node for another program; return the files.

        Parameters
        ----------
        to
            ``vtu``: one period as a series of files for ParaView (open ``motion.pvd`` and ``contacts.pvd``), and all harmonics in
            ``harmonics.vtu``; ``frd``: harmonics for CalculiX's viewer; ``uff``: deflection shapes and response functions for test
            software; ``csv``: a table of the stress at the peak. With ``[stress]``, vtu (``stress.vtu``) and frd have it, too.
        folder
            Created if missing; left out: a folder such as ``vtu_0`` or ``vtu_0_wheel`` beside the result's file.
        case
            Position among the cases of [vary].
        hz
            The converged point of the response nearest to this frequency; None: the peak.
        steps
            Number of instants in the period.
        wheel
            Whether all sectors of a tuned wheel are written instead of one. A mistuned wheel is always written whole.
        units
            Unit system of an ``frd`` file, such as ``mm-t-s``.
        of
            The model, if it was made in Python. The model of a study is built again from the study's text and files; give their folder if
            the result has been moved.
        analysis
            ``forced_response``, ``nonlinear_mode`` or ``limit_cycle``; left out: the first of these in the result.
        number
            Index of the nonlinear mode or limit cycle in the case, from 0 in the order of the result.
        amplitude_mm
            The motion of the nonlinear mode nearest to this amplitude of its output; None: the motion with the highest damping.

        Raises
        ------
        InputError
            If there is no such motion, or the model has changed since the run.
        """
        place = None if folder is None else Path(folder)
        source = Path(of) if isinstance(of, str) else of
        wanted = Wanted(to, case, hz, steps, wheel, units, analysis, number, amplitude_mm)
        with by_default():
            return export_result(self.data, self.path, place, wanted, source)

    def report(self, path: str | Path | None = None) -> Path:
        """Write the page of all figures and tables; return its path.

        Parameters
        ----------
        path
            The page; left out: ``report.html`` beside the result's file, or in the current folder.
        """
        folder = Path() if self.path is None else self.path.parent
        target = folder / "report.html" if path is None else Path(path)
        write_report(self.data, target)
        return target

    @cached_property
    def _figures(self) -> dict[str, go.Figure]:
        return plots(self.data)

    @property
    def plots(self) -> tuple[str, ...]:
        """Names of the figures, in the order of the page."""
        return tuple(self._figures)

    def plot(self, name: str, ax: Any = None, backend: Backend = "plotly", *, case: int | None = None) -> Any:
        """Return a figure of the page, or draw it for a paper.

        Parameters
        ----------
        name
            One of `plots`.
        ax
            Axes of matplotlib to draw in, one for each panel; the figure is then drawn by matplotlib, and the axes are returned.
        backend
            ``plotly``: the figure of the page, a `plotly.graph_objects.Figure`; ``matplotlib``: a new `matplotlib.figure.Figure` with
            the fonts, sizes and line widths of ``rcParams``, ready for `savefig`.
        case
            The case to show, where the page has buttons for it; None: the one that the page shows first.

        Raises
        ------
        InputError
            If the result has no figure of that name, matplotlib cannot draw it, or the axes are not as many as its panels.
        StickslipError
            If matplotlib is not installed.
        """
        return plotted(self._figures, name, ax, backend, case, "result")

    @property
    def peaks(self) -> pd.DataFrame:
        """The peak of each case of the forced response, a row a case; without one, the natural frequencies, a row a wave.

        Raises
        ------
        InputError
            If the result has neither.
        """
        if "forced_response" in self.data.children:
            return _peaks(self.data["forced_response"].to_dataset())
        name = next((n for n in WITH_PEAKS if n in self.data.children), None)
        if name is None:
            own = ", ".join(f"result.to_dataframe({one!r})" for one in self)
            raise input_error(
                "result.peaks",
                f"is of a forced response or of modes; this result has {', '.join(self)}",
                f"Take {own}.",
            )
        return _frequencies(self.data[name].to_dataset())

    @property
    def measured(self) -> pd.DataFrame:
        """The measured peaks named by the study, in SI units and Hz; empty if the study names none."""
        name = "forced_response"
        return _measured(self.data[name].to_dataset()) if name in self.data.children else pd.DataFrame()

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Verdicts on each case, and on points whose verdict differs: level, reason and remedy."""
        return of_tree(self.data)

    @property
    def not_trusted(self) -> str:
        """A line that names the doubtful and wrong cases; empty if all are trusted."""
        return not_trusted(self.data)

    @property
    def conclusion(self) -> str:
        """The last line of a run: `not_trusted`, or that every answer is trusted, with the number of doubtful points."""
        return conclusion(self.data)

    def __repr__(self) -> str:
        title = str(self.data.attrs.get("title", "")) or "untitled"
        lines = [f"Result: {title}", f"  file: {self.path or 'in memory'}"]
        for name, node in self.data.children.items():
            cases, points = node.sizes.get("case", 1), node.sizes.get("point")
            size = f"{cases} cases" if cases != 1 else "1 case"
            lines.append(f"  {name}: {size}" + (f", {points} points" if points else ""))
        lines.append(f"  plots: {', '.join(self.plots)}")
        lines += [f"  {v}" for v in self.verdicts if v.told]
        lines.append(f"  {self.conclusion}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        has = any(name in self.data.children for name in WITH_PEAKS)
        return f"<pre>{escape(repr(self))}</pre>{self.peaks._repr_html_() if has else ''}"


def result_of(outcome: Outcome) -> Result:
    """Return the result of a run; a shard that waits for others has no file yet."""
    path = outcome.files[0] if outcome.files and not outcome.waits else None
    return Result(outcome.tree, path, outcome.files, outcome.failed)


def _peaks(data: xr.Dataset) -> pd.DataFrame:
    keys = [str(k) for k in data["vary"].values] if "vary" in data.coords else []
    found = {key: np.asarray(data["vary_value"].values[:, k]) for k, key in enumerate(keys)}
    units = {"excitation_n": "excitation (N)", "peak_frequency_hz": "frequency (Hz)", "peak_amplitude": "amplitude (m)"}
    found |= {name: np.asarray(data[key].values) for key, name in units.items() if key in data}
    if "case_verdict" in data:
        found["verdict"] = np.array([LEVELS[int(v)] for v in data["case_verdict"].values])
    return pd.DataFrame(found)


def _measured(data: xr.Dataset) -> pd.DataFrame:
    if "measured_value" not in data:
        return pd.DataFrame()
    found = {str(data.attrs["measured_key"]): np.asarray(data["measured_value"].values)}
    names = {
        "measured_others": "beside it",
        "measured_excitation_n": "excitation (N)",
        "measured_frequency_hz": "frequency (Hz)",
        "measured_frequency_hz_error": "its {} (Hz)",
        "measured_amplitude": "amplitude ({})",
        "measured_amplitude_error": "its {} ({})",
    }
    for key, text in names.items():
        values = data[key].values if key in data else np.zeros(0)
        if values.size and (any(values) if values.dtype.kind == "U" else np.isfinite(values).any()):
            told = [data[key].attrs.get(name, "") for name in ("error", "units")]
            found[text.format(*filter(None, told))] = np.asarray(values)
    return pd.DataFrame(found)


def _frequencies(data: xr.Dataset) -> pd.DataFrame:
    """Return a row a wave of the first case."""
    first = data.isel(case=0) if "case" in data.dims else data
    hz = np.asarray(first["frequency_hz"].values)
    found = {name.replace("_", " "): np.asarray(first[name].values) for name in ("nodal_diameter", "wave_kind")}
    return pd.DataFrame(found | {f"mode {m + 1} (Hz)": hz[:, m] for m in range(hz.shape[1])})
