"""The motion to export: a point of a forced response, of a nonlinear mode, or a limit cycle."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import input_error
from stickslip.reduction.waves import NO_WAVE
from stickslip.study.store.netcdf import one_case
from stickslip.units import HZ, millimetres

ROUNDED = 1e-3  # relative rounding of a number that a user read from a table
FORCED, MODE, CYCLE = "forced_response", "nonlinear_mode", "limit_cycle"


@dataclass(frozen=True, eq=False)
class Chosen:
    """A motion of a result.

    Parameters
    ----------
    analysis
        Name of the analysis.
    told
        Description of the motion in words.
    label
        Label of the case.
    omega
        Frequency, rad/s.
    labels, retained
        Names (n,) and motion (H+1, n) of the retained coordinates, m.
    outputs, reported
        Names (k,) and motion (H+1, k) of the outputs, m.
    orders
        Possible values of the highest harmonic of the assembled model.
    wave_number
        Wave number of a free motion of a tuned wheel; else None.
    free
        Whether the motion is free of harmonic loads.
    rate, decays
        Mass-proportional damping that sustains the motion, 1/s; decay rate of the motion without it, 1/s.
    point
        Index among all points of the forced response; else None.
    """

    analysis: str
    told: str
    label: str
    omega: float
    labels: tuple[str, ...]
    retained: ComplexArray
    outputs: tuple[str, ...]
    reported: ComplexArray
    orders: tuple[int, ...]
    wave_number: int | None = None
    free: bool = False
    rate: float = 0.0
    decays: float = 0.0
    point: int | None = None

    @property
    def hz(self) -> float:
        """Frequency in Hz."""
        return self.omega / HZ


def chosen(
    tree: xr.DataTree,
    analysis: str = "",
    case: int = 0,
    *,
    number: int = 0,
    hz: float | None = None,
    amplitude_mm: float | None = None,
) -> Chosen:
    """Return a motion of a result.

    Parameters
    ----------
    tree
        The result.
    analysis
        Name of the analysis; empty: the first one whose motions can be written.
    case
        Index of the case.
    number
        Index of the nonlinear mode or limit cycle in the case, from 0.
    hz
        Frequency of the wanted point of a forced response; the nearest point is chosen. None: the peak.
    amplitude_mm
        Amplitude of the wanted motion of a nonlinear mode; the nearest motion is chosen. None: the motion with the highest damping.

    Raises
    ------
    InputError
        If there is no such motion.
    """
    name = _analysis(tree, analysis)
    data = tree[name].to_dataset()
    cases = data.sizes["case"]
    if not 0 <= case < cases:
        remedy = f"Give a number from 0 to {cases - 1}, in the order of [vary]."
        raise input_error("export: case", f"is {case}, and the result has {cases}", remedy)
    _refuse_unused(name, number=number, hz=hz, amplitude_mm=amplitude_mm)
    if name == FORCED:
        return _forced(data, case, point_of(data, case, hz))
    if "retained_displacement" not in data:
        what = f"the result keeps no motion of [{name}]: it has none, or an earlier version wrote it"
        raise input_error("export", what, "Run the study again with --fresh.")
    own = one_case(data, case)
    label = str(data["case_label"].values[case]) if "case_label" in data else ""
    of = _mode if name == MODE else _cycle
    return of(own, label, number, amplitude_mm)


def _analysis(tree: xr.DataTree, wanted: str) -> str:
    can = [name for name in WRITTEN if name in tree.children]
    if wanted not in ("", *can) or not can:
        named, has = (", ".join(f"[{n}]" for n in names) for names in (WRITTEN, can or tree.children))
        of = f"{wanted!r} cannot be written: " if wanted else ""
        what = f"{of}motions are written of {named}; this result has {has or 'nothing'}"
        remedy = f"Name {has}." if can else "Ask the study for one of these."
        raise input_error("export", what, remedy)
    return wanted or can[0]


def _refuse_unused(name: str, *, number: int, hz: float | None, amplitude_mm: float | None) -> None:
    """Refuse arguments that select a point of another analysis."""
    beside = {
        "hz": hz is not None and name != FORCED,
        "number": number != 0 and name == FORCED,
        "amplitude_mm": amplitude_mm is not None and name != MODE,
    }
    for key in (key for key, wrong in beside.items() if wrong):
        raise input_error(f"export: {key}", f"is given, and {HOW[name]}", "Leave it out.")


def point_of(data: xr.Dataset, case: int, hz: float | None) -> int:
    """Return the index of the peak of a forced response, or of the converged point nearest to a frequency.

    Raises
    ------
    InputError
        If no point has converged, or the frequency lies outside the response.
    """
    solved = np.isfinite(data["retained_displacement"].values).any(axis=(1, 2, 3))
    mine = np.flatnonzero((data["point_case"].values == case) & solved)
    if not mine.size:
        raise input_error("export", f"no point of case {case} has converged", "Export another case.")
    if hz is None:
        peak = int(data["peak_point"].values[case])
        if peak in mine:
            return peak
        raise input_error("export", f"case {case} has no peak", "Give a frequency: hz = ...")
    every = data["frequency_hz"].values[mine]
    if not (1 - ROUNDED) * every.min() <= hz <= (1 + ROUNDED) * every.max():
        raise input_error(
            "export: hz",
            f"is {hz:g}, and case {case} goes from {every.min():.6g} to {every.max():.6g} Hz",
            "Give a frequency of the response; the nearest point that was computed is taken.",
        )
    return int(mine[np.argmin(np.abs(every - hz))])


def as_complex(values: FloatArray) -> ComplexArray:
    """Return complex numbers from stored pairs (real, imaginary) in the last dimension."""
    return np.asarray(values[..., 0] + 1j * values[..., 1])


def _forced(data: xr.Dataset, case: int, point: int) -> Chosen:
    hz, told = float(data["frequency_hz"].values[point]), str(data.attrs["report_output"])
    amplitude = float(data["amplitude"].sel(output=told).values[point])
    label = str(data["case_label"].values[case]) if "case_label" in data else ""
    what = "its peak" if point == int(data["peak_point"].values[case]) else "the point"
    retained, labels = _known(data["retained_displacement"].values[point], data["retained"].values)
    reported, outputs = _known(data["output_displacement"].values[point], data["output"].values)
    most = max(_highest(retained), 1)
    highest = int(data.attrs.get("high_order", most))
    return Chosen(
        FORCED,
        f"{_of_case(label)}{what} at {hz:.6g} Hz, {millimetres(amplitude)} of {told}",
        label,
        hz * HZ,
        labels,
        retained[: most + 1],
        outputs,
        reported[: most + 1],
        orders=(most, highest),
        point=point,
    )


def _mode(own: xr.Dataset, label: str, number: int, amplitude_mm: float | None) -> Chosen:
    """Return a motion of a nonlinear mode."""
    _require_number(own, "branch", MODE, number)
    branch = own.isel(branch=number)
    solved = np.isfinite(branch["retained_displacement"].values).any(axis=(1, 2, 3))
    if not solved.any():
        remedy = "Name another one: number = ..."
        raise input_error("export", f"no motion of mode {number} was found", remedy)
    amplitude, ratio = (branch[name].values for name in ("amplitude", "damping_ratio"))
    if amplitude_mm is None:
        point = int(np.nanargmax(np.where(solved, ratio, np.nan)))
    else:
        size = 1e3 * amplitude[solved]
        if not (1 - ROUNDED) * size.min() <= amplitude_mm <= (1 + ROUNDED) * size.max():
            raise input_error(
                "export: amplitude_mm",
                f"is {amplitude_mm:g}, and the mode goes from {size.min():.4g} to {size.max():.4g} mm",
                "Give an amplitude of the mode; the nearest motion that was computed is taken.",
            )
        point = int(np.flatnonzero(solved)[np.argmin(np.abs(size - amplitude_mm))])
    hz, damping = float(branch["frequency_hz"].values[point]), float(ratio[point])
    wave = int(branch["wave_number"].values)
    what = "the most damped motion" if amplitude_mm is None else "the motion"
    told = f"{_of_case(label)}{_of_wave(wave)}nonlinear mode {int(branch['mode'].values)}, {what}: {millimetres(amplitude[point])} of {own.attrs['output']} at {hz:.6g} Hz, damping ratio {100 * damping:.3g} %"
    return _free(branch.isel(point=point), own, MODE, told, label, (hz, damping, wave))


def _cycle(own: xr.Dataset, label: str, number: int, _amplitude_mm: float | None) -> Chosen:
    """Return a limit cycle."""
    _require_number(own, "cycle", CYCLE, number)
    cycle = own.isel(cycle=number)
    wave = int(own["wave_number"].values[int(cycle["cycle_branch"].values)])
    hz = float(cycle["cycle_frequency_hz"].values)
    size, word = float(cycle["cycle_amplitude"].values), str(cycle["cycle_stability"].values)
    told = f"{_of_case(label)}{_of_wave(wave)}limit cycle {number} ({word}): {millimetres(size)} of {own.attrs['output']} at {hz:.6g} Hz"
    return _free(cycle, own, CYCLE, told, label, (hz, 0.0, wave))


def _free(one: xr.Dataset, own: xr.Dataset, name: str, told: str, label: str, at: tuple[float, float, int]) -> Chosen:
    """Return a free motion from its frequency, damping ratio and wave number."""
    hz, ratio, wave = at
    retained, labels = _known(one["retained_displacement"].values, own["retained_label"].values)
    reported, outputs = _known(one["output_displacement"].values, own["output_label"].values)
    most, omega, rate, decays = max(_highest(retained), 1), hz * HZ, -2.0 * ratio * hz * HZ, 0.0
    if own.attrs.get("concept") == "decaying":
        omega, rate, decays = omega * float(np.sqrt(1.0 - ratio**2)), 0.0, ratio * omega
    return Chosen(
        name,
        told,
        label,
        omega,
        labels,
        retained[: most + 1],
        outputs,
        reported[: most + 1],
        orders=(most,),
        wave_number=None if wave == NO_WAVE else wave,
        free=True,
        rate=rate,
        decays=decays,
    )


def _require_number(own: xr.Dataset, dim: str, name: str, number: int) -> None:
    count = own.sizes.get(dim, 0)
    if not 0 <= number < count:
        what = f"is {number}, and the case has {count} of [{name}]"
        raise input_error("export: number", what, "Count from 0, in the order of the result.")


def _known(values: FloatArray, labels: FloatArray) -> tuple[ComplexArray, tuple[str, ...]]:
    """Return names and motion (H+1, n) of the stored coordinates; missing harmonics are zero."""
    there = np.isfinite(values).any(axis=(0, 2))
    own = np.nan_to_num(values[:, there])
    names = tuple(str(label) for label in np.asarray(labels)[there])
    return as_complex(own), names


def _highest(motion: ComplexArray) -> int:
    return int(np.flatnonzero(np.abs(motion).max(axis=1, initial=0.0)).max(initial=0))


def _of_case(label: str) -> str:
    return f"{label}: " if label else ""


def _of_wave(wave: int) -> str:
    return "" if wave == NO_WAVE else f"wave {wave}, "


WRITTEN = (FORCED, MODE, CYCLE)
HOW: Mapping[str, str] = {
    FORCED: "points of a forced response are picked by their frequency, hz",
    MODE: "motions of a nonlinear mode are picked by number and amplitude_mm",
    CYCLE: "limit cycles are picked by their number",
}
