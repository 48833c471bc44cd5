"""Designs that are compared: their responses, peaks and inputs side by side."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.readers.measured_columns import LENGTHS, read_columns
from stickslip.report.cases import ShownCase
from stickslip.report.plot import colour
from stickslip.report.response import NEEDED, Response
from stickslip.report.result import analysis
from stickslip.report.waves import Waves

NAME = "forced_response"
_PER_NEWTON = {f"{unit}_per_n": factor for unit, factor in LENGTHS.items()}
MISSING = "not given"


@dataclass(frozen=True, eq=False)
class Design:
    """A result under a name.

    Parameters
    ----------
    name
        In legends and tables.
    tree
        The result.
    index
        Its place in the comparison.
    """

    name: str
    tree: xr.DataTree
    index: int

    @property
    def colour(self) -> str:
        """CSS colour of its lines."""
        return colour(self.index)

    @cached_property
    def response(self) -> Response | None:
        """Its forced response; None without one."""
        if NAME not in self.tree.children:
            return None
        data = analysis(self.tree, NAME)
        known = all(name in data for name in NEEDED) and bool(data.sizes.get("case"))
        return Response(data) if known else None

    @cached_property
    def modes(self) -> Waves | None:
        """Its modes, of the first case; None without them."""
        if "modes" not in self.tree.children:
            return None
        data = analysis(self.tree, "modes")
        return Waves(data.isel(case=0) if "case" in data.dims else data)

    @cached_property
    def inputs(self) -> dict[str, str]:
        """All values of its study file by their dotted keys; empty for a model of Python."""
        try:
            return flattened(tomllib.loads(str(self.tree.attrs.get("study_toml", ""))))
        except tomllib.TOMLDecodeError:
            return {}

    def case(self, label: str) -> ShownCase | None:
        """Return the case of a label; the only one whatever its label; None where there is none."""
        cases = self.response.cases if self.response else ()
        if len(cases) == 1:
            return cases[0]
        return next((c for c in cases if c.label == label), None)

    @property
    def best(self) -> ShownCase | None:
        """Of its cases with the best verdict, the one with the smallest peak."""
        if self.response is None or self.response.chosen < 0:
            return None
        return self.response.cases[self.response.chosen]


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """A response of a measurement or of another program.

    Parameters
    ----------
    name
        In legends and tables.
    hz
        (n,) frequencies, rising.
    amplitude
        (n,) in m, or in m/N.
    per_force
        Whether it is divided by the excitation.
    """

    name: str
    hz: FloatArray
    amplitude: FloatArray
    per_force: bool


def flattened(table: Mapping[str, Any], before: str = "") -> dict[str, str]:
    """Return the values of nested tables by their dotted keys."""
    found: dict[str, str] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            found |= flattened(value, f"{before}{key}.")
        else:
            found[f"{before}{key}"] = str(value)
    return found


def differences(designs: Sequence[Design]) -> list[list[str]]:
    """Return a row for each key of the study files that is not the same in all: the key, then its value in each design."""
    keys = dict.fromkeys(key for d in designs for key in d.inputs)
    rows = [[key, *(d.inputs.get(key, MISSING) for d in designs)] for key in keys]
    return [row for row in rows if len(set(row[1:])) > 1]


def read_curve(path: Path) -> MeasuredCurve:
    """Read a response from a CSV file with the columns ``frequency_hz`` and ``amplitude_um`` (``_mm``, ``_m``), or ``amplitude_um_per_n`` (``_mm_per_n``, ``_m_per_n``).

    Raises
    ------
    InputError
        Naming the file, the column and what to do.
    """
    columns = read_columns(path)
    hz = columns.required("frequency", {"hz": 1.0})
    per_force = bool(columns.named("amplitude", _PER_NEWTON)[0])
    units = _PER_NEWTON if per_force else LENGTHS
    amplitude = columns.required("amplitude", units)
    for row in np.flatnonzero(amplitude < 0)[:1]:
        name = columns.named("amplitude", units)[0]
        raise columns.wrong(int(row), name, "is no amplitude: it is below zero", "Give its size.")
    order = np.argsort(hz, kind="stable")
    return MeasuredCurve(path.stem, hz[order], amplitude[order], per_force)


def per_force(designs: Sequence[Design], curves: Sequence[MeasuredCurve]) -> bool:
    """Say whether amplitudes are compared per newton of the excitation: where nothing stands against it.

    Raises
    ------
    InputError
        If curves cannot be compared with what the designs have.
    """
    able = all(d.response.per_force for d in designs if d.response)
    kinds = {c.per_force for c in curves}
    if len(kinds) > 1:
        raise input_error(
            ", ".join(c.name for c in curves),
            "are amplitudes and amplitudes per newton",
            "Give all of them in one kind of column.",
        )
    if kinds == {True} and not able:
        raise input_error(
            curves[0].name,
            "is an amplitude per newton, but not every design has one harmonic load to divide by",
            "Give a column amplitude_um, amplitude_mm or amplitude_m.",
        )
    return kinds.pop() if kinds else able
