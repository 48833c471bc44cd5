"""A result file as the report sees it: the dataset, and the few things every figure asks of it."""

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.report.quantities import number, predicted
from stickslip.response.forced.sweep import FIXED
from stickslip.study.harmonics_table import named

NEEDED = (
    "load_ratio",
    "excitation_n",
    "case",
    "frequency_hz",
    "order",
    "status",
    "amplitude",
)
RATIO = "F<sub>CL</sub>/F<sub>HE</sub>"
# from navy (stuck) over purple and red to dark gold (nonlinear): darker means stiffer, in grey as well
_STOPS = ((20, 24, 96), (112, 30, 158), (200, 44, 110), (232, 100, 40), (212, 156, 0))


@dataclass(frozen=True)
class Case:
    """One load case.

    Parameters
    ----------
    index
        Position along ``load_case`` in the dataset.
    ratio
        Static over harmonic load, F_CL/F_HE.
    excitation
        Amplitude of the harmonic load in N.
    colour
        CSS colour, dark for the most stuck case and gold for the most nonlinear one.
    """

    index: int
    ratio: float
    excitation: float
    colour: str

    @property
    def label(self) -> str:
        """The ratio as text."""
        return number(self.ratio, 4)


@dataclass(frozen=True, eq=False)
class Alert:
    """The solutions about which the strategy was asked, one a frequency: the first one by an alert, else the accepted one."""

    case: IntArray  # index of the load case
    hz: FloatArray
    error: FloatArray  # percent, as predicted; of a strategy that predicts no error its indicator


@dataclass(frozen=True, eq=False)
class Result:
    """A result in memory.

    Parameters
    ----------
    data
        The dataset of docs/design.md; any of its variables but those of `NEEDED` may be missing.
    cases
        Load cases from the most stuck (largest ratio) to the most nonlinear.
    """

    data: xr.Dataset
    cases: tuple[Case, ...]

    def has(self, *names: str) -> bool:
        """Say whether all the variables are there and none is empty."""
        return all(name in self.data and self.data[name].size > 0 for name in names)

    def integers(self, name: str) -> IntArray:
        """Return the values of a variable as integers."""
        return np.asarray(self.data[name].values).astype(np.int64)

    def floats(self, name: str) -> FloatArray:
        """Return the values of a variable as floats; NaN of the shape of ``point`` if it is missing."""
        if name not in self.data:
            return np.full(self.data.sizes["point"], np.nan)
        return np.asarray(self.data[name].values, dtype=np.float64)

    def labels(self, dimension: str) -> tuple[str, ...]:
        """Return the labels of a dimension, escaped for HTML; numbers where it has none."""
        if dimension in self.data.coords:
            return tuple(escape(str(v)) for v in self.data[dimension].values)
        return tuple(str(i) for i in range(self.data.sizes.get(dimension, 0)))

    def text(self, attribute: str, default: str = "") -> str:
        """Return an attribute as text, not escaped."""
        value = self.data.attrs.get(attribute, default)
        return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)

    def scalar(self, attribute: str, default: float) -> float:
        """Return an attribute as a number, the default where it is missing or no number."""
        try:
            return float(np.asarray(self.data.attrs.get(attribute, default)).reshape(-1)[0])
        except (ValueError, IndexError):
            return default

    @property
    def output(self) -> int:
        """Position of the report output along ``output``."""
        names = [str(v) for v in self.data["output"].values] if "output" in self.data.coords else []
        wanted = self.text("report_output")
        return names.index(wanted) if wanted in names else 0

    @property
    def output_name(self) -> str:
        """Label of the report output, escaped."""
        return self.labels("output")[self.output]

    @property
    def converged(self) -> npt.NDArray[np.bool_]:
        """(point,) True where the point was accepted: the flag that means ``converged``, else zero."""
        attributes = self.data["status"].attrs
        meanings = str(attributes.get("flag_meanings", "")).split()
        values = np.atleast_1d(np.asarray(attributes.get("flag_values", [])))
        good = [v for v, m in zip(values, meanings, strict=False) if m == "converged"]
        return np.isin(self.integers("status"), good or [0])

    @property
    def alert(self) -> Alert:
        """Where the strategy was asked; the accepted points that have a predicted error in files which do not say."""
        if "alert_error_percent" in self.data:
            return Alert(
                self.integers("alert_case"),
                self.floats("alert_frequency_hz"),
                self.floats("alert_error_percent"),
            )
        error = self.floats("predicted_error_percent" if self.is_error else "indicator")
        at = np.flatnonzero(~np.isnan(error))
        return Alert(self.integers("case")[at], self.floats("frequency_hz")[at], error[at])

    @property
    def selection(self) -> str:
        """Name of the strategy, escaped."""
        return escape(self.text("selection", "jacobian_alert"))

    @property
    def is_error(self) -> bool:
        """Whether the strategy's indicator is the predicted error of a solution."""
        return self.text("indicator_name", "predicted error") == "predicted error"

    @property
    def decides(self) -> bool:
        """Whether anything chose: not with the same harmonics at every frequency."""
        return self.selection not in FIXED

    @property
    def threshold(self) -> float:
        """Threshold of the strategy; in percent where it is one of an error."""
        if self.is_error:
            return self.scalar("alert_threshold_percent", 5.0)
        return self.scalar("selection_threshold", float("nan"))

    def shown(self, indicator: float) -> str:
        """Write what `alert` holds: in percent where it is an error."""
        if self.is_error:
            return predicted(indicator)
        return "beyond all bounds" if np.isinf(indicator) else number(indicator)

    @property
    def low_harmonics(self) -> IntArray:
        """Harmonics of the first passage, from 0."""
        return self._support("low", 1)

    @property
    def high_harmonics(self) -> IntArray:
        """Harmonics of the reference, from 0."""
        return self._support("high", 5)

    def _support(self, which: str, default: int) -> IntArray:
        full = np.arange(int(self.scalar(f"{which}_order", default)) + 1)
        return np.atleast_1d(np.asarray(self.data.attrs.get(f"{which}_harmonics", full))).astype(
            np.int64
        )

    @property
    def low_name(self) -> str:
        """Harmonics of the first passage as text."""
        return named(self.low_harmonics)

    @property
    def high_name(self) -> str:
        """Harmonics of the reference as text."""
        return named(self.high_harmonics)

    @property
    def kept(self) -> IntArray:
        """(point, harmonic) 1 where the solution keeps the harmonic; all up to its order in files that do not say."""
        if "harmonic_kept" in self.data:
            return np.asarray(
                self.data["harmonic_kept"].transpose("point", "harmonic").values
            ).astype(np.int64)
        harmonic = np.arange(int(self.high_harmonics[-1]) + 1)
        return (harmonic <= self.integers("order")[:, None]).astype(np.int64)

    @property
    def more(self) -> npt.NDArray[np.bool_]:
        """(point,) True where the solution keeps harmonics that the first passage does not."""
        own = np.isin(np.arange(self.kept.shape[1]), self.low_harmonics)
        return np.asarray((self.kept[:, ~own] > 0).any(axis=1))

    @property
    def more_name(self) -> str:
        """What such points keep, as text: the harmonics of the reference where it is all of them."""
        some = self.kept[self.more]
        own = np.isin(np.arange(self.kept.shape[1]), self.high_harmonics)
        return f"H = {self.high_name}" if bool((some == own).all()) else "more harmonics"

    def response(self, name: str = "amplitude") -> FloatArray:
        """(point,) amplitude of the report output divided by the excitation, m/N."""
        force = self.floats("excitation_n")[self.integers("case")]
        values = self.data[name].isel(output=self.output).values
        return np.asarray(np.asarray(values, dtype=np.float64) / force)

    def points(self, case: Case) -> IntArray:
        """Points of a case in the order in which a curve joins them, the unconverged ones included.

        A branch that folds back keeps its order and leaves out the peak refinements, whose place on it is
        not stored; otherwise the order is that of frequency.
        """
        index = np.flatnonzero(self.integers("case") == case.index)
        hz = self.floats("frequency_hz")[index]
        refined = np.nan_to_num(self.floats("refinement")[index]) > 0
        along = np.diff(hz[~refined])
        if np.any(along > 0) and np.any(along < 0):
            return index[~refined]
        return index[np.argsort(hz, kind="stable")]

    def peak(self, case: Case) -> int:
        """Position of the peak along ``point``; -1 if there is none."""
        if "peak_point" not in self.data:
            return -1
        value = self.floats("peak_point")[case.index]
        inside = np.isfinite(value) and 0 <= value < self.data.sizes["point"]
        return int(value) if inside else -1

    @property
    def peaked(self) -> tuple[Case, ...]:
        """The cases that have a peak."""
        return tuple(c for c in self.cases if self.peak(c) >= 0)


def _colours(n: int) -> list[str]:
    """Return `n` colours from dark (stuck) to gold (nonlinear), all readable on white."""
    stops = np.array(_STOPS, dtype=float)
    at = np.linspace(0, len(stops) - 1, n)
    mix = np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(3)], axis=1)
    return [f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in mix]


def _cases(data: xr.Dataset) -> tuple[Case, ...]:
    ratio = np.atleast_1d(np.asarray(data["load_ratio"].values, dtype=float))
    force = np.atleast_1d(np.asarray(data["excitation_n"].values, dtype=float))
    order = np.argsort(-ratio, kind="stable")
    return tuple(
        Case(int(i), float(ratio[i]), float(force[i]), colour)
        for i, colour in zip(order, _colours(len(order)), strict=True)
    )


def _missing(names: Iterable[str], data: xr.Dataset) -> list[str]:
    return [name for name in names if name not in data]


def load_result(path: Path) -> Result:
    """Read a result file.

    Parameters
    ----------
    path
        netCDF-4 file written by ``stickslip run``, finished or not.
    """
    if not path.is_file():
        raise input_error(
            str(path), "no such file", "Give the result.nc that `stickslip run` wrote."
        )
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
            data = file.load()
    except (OSError, ValueError) as error:
        raise input_error(
            str(path),
            f"not a netCDF-4 file ({error})",
            "Give the result.nc that `stickslip run` wrote.",
        ) from error
    missing = _missing(NEEDED, data)
    if missing:
        raise input_error(
            str(path),
            f"variables {', '.join(missing)} are missing",
            "This is not a result of `stickslip run`; run the study again.",
        )
    return Result(data, _cases(data))
