"""Compared designs: responses, peaks and inputs."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.page.response import NEEDED, Response
from stickslip.analyses.waves.page.waves import Waves, view_of
from stickslip.analyses.waves.records import Modes
from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.readers.measured_columns import LENGTHS, read_columns
from stickslip.report.cases import ShownCase
from stickslip.report.plot import colour
from stickslip.report.result import analysis
from stickslip.study.coordinates import as_number, varied_values

NAME = "forced_response"
_PER_NEWTON = {f"{unit}_per_n": factor for unit, factor in LENGTHS.items()}
MISSING = "not given"


@dataclass(frozen=True, eq=False)
class Design:
    """A result with a name.

    Parameters
    ----------
    name
        Name in legends and tables.
    tree
        The result.
    index
        Index in the comparison.
    """

    name: str
    tree: xr.DataTree
    index: int

    @property
    def colour(self) -> str:
        """CSS colour of its curves."""
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
    def modes(self) -> Waves[Modes] | None:
        """Its modes in the first case; None without them."""
        if "modes" not in self.tree.children:
            return None
        data = analysis(self.tree, "modes")
        return view_of(Modes)(data.isel(case=0) if "case" in data.dims else data)

    @cached_property
    def inputs(self) -> dict[str, Any]:
        """All values of its study file by their dotted keys; empty for a Python model."""
        try:
            return flattened(tomllib.loads(str(self.tree.attrs.get("study_toml", ""))))
        except tomllib.TOMLDecodeError:
            return {}

    def case(self, like: ShownCase) -> ShownCase | None:
        """Return the case that varies the same keys to the same values as a case of another design; None without one."""
        cases = self.response.cases if self.response else ()
        return next((c for c in cases if c.identity == like.identity), None)

    def held_against(self, case: ShownCase, other: "Design") -> ShownCase | None:
        """Return the case to compare with a case of another design: the same case, the only one, or one with the same values."""
        cases = self.response.cases if self.response else ()
        own = self.case(case)
        if self.response is None or own is not None or len(cases) == 1:
            return own or next(iter(cases), None)
        keys, values = varied_values(self.response.data)
        given = [other.inputs.get(key) for key in keys]
        same = (c for c in cases if all(map(_alike, given, values[c.index])))
        return None if case.label else next(same, None)

    def best(self, *, divided: bool) -> ShownCase | None:
        """Return the case with the smallest peak among the best verdicts; `divided`: the peak per newton of its load."""
        if self.response is None or self.response.chosen < 0:
            return None
        first, own = self.response.cases[self.response.chosen], self.response
        if divided or not own.per_force:
            return first
        alike = [c for c in own.peaked if own.level(c) == own.level(first) and own.resonates(c) == own.resonates(first)]
        return min(alike, key=lambda c: own.peak_response(c) * c.excitation)


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """A response from a measurement or another program.

    Parameters
    ----------
    name
        Name in legends and tables.
    hz
        (n,) frequencies, rising.
    amplitude
        (n,) in m, or in m/N.
    per_force
        Whether amplitudes are divided by the excitation.
    """

    name: str
    hz: FloatArray
    amplitude: FloatArray
    per_force: bool


def _alike(given: object, value: object) -> bool:
    return str(given) == str(value) or as_number(given) == as_number(value)


def flattened(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return the values of nested tables by their dotted keys."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            found |= flattened(value, f"{before}{key}.")
        else:
            found[f"{before}{key}"] = value
    return found


def differences(designs: Sequence[Design]) -> list[list[str]]:
    """Return one row for each key whose values differ between the study files: the key, then its value in each design."""
    keys = dict.fromkeys(key for d in designs for key in d.inputs)
    rows = [[key, *(d.inputs.get(key, MISSING) for d in designs)] for key in keys]
    return [[row[0], *map(_plain, row[1:])] for row in rows if any(c != row[1] for c in row[2:])]


def _plain(value: Any) -> str:
    """Return a value of a study file as text: numbers with all their digits, lists without quotes."""
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def read_curve(path: Path) -> MeasuredCurve:
    """Read a response from a CSV file with the columns ``frequency_hz`` and ``amplitude_um`` (``_mm``, ``_m``), or ``amplitude_um_per_n`` (``_mm_per_n``, ``_m_per_n``).

    Raises
    ------
    InputError
        Naming the file, the column and a remedy.
    """
    columns = read_columns(path)
    hz = columns.required("frequency", {"hz": 1.0})
    per_force = bool(columns.named("amplitude", _PER_NEWTON)[0])
    units = _PER_NEWTON if per_force else LENGTHS
    amplitude = columns.required("amplitude", units)
    for row in np.flatnonzero(amplitude < 0)[:1]:
        name = columns.named("amplitude", units)[0]
        raise columns.wrong(int(row), name, "is no amplitude: it is below zero", "Give its size.")
    if not np.any(amplitude):
        name = columns.named("amplitude", units)[0]
        raise input_error(f"{path}: {name}", "is zero everywhere", "Give the measured amplitudes.")
    order = np.argsort(hz, kind="stable")
    return MeasuredCurve(path.stem, hz[order], amplitude[order], per_force)


def per_force(designs: Sequence[Design], curves: Sequence[MeasuredCurve]) -> bool:
    """Return whether amplitudes are compared per newton of the excitation; true if all designs and curves allow it.

    Raises
    ------
    InputError
        If curves and designs, or the outputs of the designs, have different units.
    """
    known = [d.response for d in designs if d.response]
    if curves and not known:
        raise input_error(
            curves[0].name, "has no forced response to be held against", "Give a result with [forced_response]."
        )
    if len({r.length for r in known}) > 1:
        told = ", ".join(f"{d.name}: {d.response.output_name}" for d in designs if d.response)
        raise input_error(
            told, "are displacements and rotations", "Compare results with the same kind of [output] peak."
        )
    able = all(r.per_force for r in known)
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
