"""Records of limit cycles: a branch for each mode of each wave, its cycles, and the record of a case."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stickslip.analyses.vibrating import KeptMotions, kept_motions, mode_name
from stickslip.arrays import FloatArray, IntArray
from stickslip.column import column, rows
from stickslip.reduction.waves import NO_WAVE, wave
from stickslip.study.analysis import Solved
from stickslip.units import HZ


@dataclass(frozen=True, eq=False, kw_only=True)
class Cycle:
    """A limit cycle.

    Attributes
    ----------
    coefficients
        (harmonics + 1, n, 2) amplitudes of all coordinates, real and imaginary, m. A job keeps them; a result holds retained coordinates
        and outputs.
    """

    amplitude: float = column("m", "its amplitude")
    omega: float = column("Hz", "its frequency", "frequency_hz", per=HZ)
    slope: float = column("1", "growth of the damping ratio with the logarithm of the amplitude; positive: attracting")
    harmonics: int = column("1", "its highest harmonic")
    change: float = column("1", "relative change by the last raise of the harmonics")
    enough: bool = column("1", "1 where the harmonics are enough")
    stability: str = column("1", "stable, unstable, undecided or not examined")
    reason: str = column("1", "what that rests on")
    multiplier: float = column("1", "modulus of the multiplier that decides")
    multiplier_error: float = column("1", "its error")
    along: float = column("1", "distance of the multiplier along the motion from 1")
    growing_wave: int = column("1", "wave number of the disturbance that decides; -1 where unknown")
    growing_omega: float = column("Hz", "its frequency", "growing_frequency_hz", per=HZ)
    time_amplitude: float | None = column("m", "amplitude that time integration goes to", default=None)
    time_omega: float | None = column("Hz", "its frequency", "time_frequency_hz", per=HZ, default=None)
    coefficients: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 2)))

    @property
    def attracting(self) -> bool:
        """Whether neighbouring motions of the same wave approach it."""
        return self.slope > 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class CycleBranch:
    """A mode of a wave: damping over amplitude, and its limit cycles."""

    wave_number: int = column("1", "wave number of the modes followed; -1 for a single structure")
    nodal_diameter: int = column("1", "its nodal diameters; -1 for a single structure", default=NO_WAVE)
    mode: int = column("1", "number of the mode, by frequency")
    omega: float = column("Hz", "frequency with contacts stuck", "mode_frequency_hz", per=HZ)
    ratio: float = column("1", "damping ratio with contacts stuck", "mode_damping_ratio")
    slip_amplitude: float = column("m", "amplitude at which slip begins")
    largest_damping_ratio: float = column("1", "largest damping ratio over the amplitude")
    largest_damping_amplitude: float = column("m", "amplitude there")
    problem: str = column("1", "why there is no curve", default="")
    lost_cycles: int = column("1", "zeros of the damping that were not solved as limit cycles", default=0)
    amplitude: FloatArray = column("m", "amplitude of the output in the first harmonic", along="point")
    motion_omega: FloatArray = column("Hz", "frequency of the motion", "frequency_hz", per=HZ, along="point")
    damping_ratio: FloatArray = column("1", "damping ratio of the motion; negative: it grows", along="point")
    cycles: tuple[Cycle, ...] = rows("cycle", "cycle_", "index of the branch of a limit cycle")

    @property
    def name(self) -> str:
        """Name of the mode."""
        return mode_name(self.wave_number, self.mode)

    @property
    def attracting(self) -> tuple[Cycle, ...]:
        """The attracting cycles of the mode."""
        return tuple(cycle for cycle in self.cycles if cycle.attracting)

    @property
    def unbounded(self) -> bool:
        """Whether the mode grows at every amplitude examined."""
        return self.ratio < 0.0 and not self.largest_damping_ratio > 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitCycles(KeptMotions):
    """Record of a case."""

    output: str = column("1", "output whose amplitude is given", default="")
    linear_wave: IntArray | None = column(
        "1", "wave number of the modes looked at; -1 for a single structure", along="linear", default=None
    )
    linear_frequency_hz: FloatArray | None = column(
        "Hz", "frequency of the modes with contacts stuck", along="linear mode", default=None
    )
    linear_damping_ratio: FloatArray | None = column(
        "1", "their damping ratio; negative: they grow", along="linear mode", default=None
    )
    time: FloatArray | None = column(
        "s", "time since the mixed start of all unstable waves", along="window", default=None
    )
    wave_amplitude: FloatArray | None = column(
        "m", "amplitude of each wave number at the output", along="window wave", default=None
    )
    outcome: str | None = column("1", "what became of the mixed start", default=None)
    outcome_missing: str | None = column(
        "1", "why there is no mixed start; empty where there is one or it was not asked for", default=None
    )
    branches: tuple[CycleBranch, ...] = rows("branch")

    @property
    def cycles(self) -> list[tuple[CycleBranch, Cycle]]:
        """All limit cycles, each with its branch."""
        return [(branch, cycle) for branch in self.branches for cycle in branch.cycles]

    @property
    def least_damping(self) -> float:
        """Smallest damping ratio of the modes examined, contacts stuck."""
        return float("nan") if self.linear_damping_ratio is None else float(np.nanmin(self.linear_damping_ratio))


def answer(solved: Solved) -> LimitCycles:
    """Return the record of a case from the branches and notes of its job."""
    notes, model = solved.notes, solved.notes.get("model", {})
    branches: Sequence[CycleBranch] = solved.records
    found: dict[str, Any] = {"output": str(model.get("output", ""))}
    if "linear" in notes:
        own = notes["linear"]
        found |= {
            "linear_wave": np.asarray(own["wave"]),
            "linear_frequency_hz": np.asarray(own["hertz"]),
            "linear_damping_ratio": np.asarray(own["ratio"]),
        }
    if not branches:
        return LimitCycles(**found)
    in_time = [notes.get(f"in_time.{i}") for i in range(len(branches))]
    if all(own is not None for own in in_time):
        branches = [_with_time(b, own) for b, own in zip(branches, in_time, strict=True) if own]
    sectors = int(model.get("sectors", 1))
    found["branches"] = tuple(_with_diameters(b, sectors) for b in branches)
    if "coordinates" in notes:
        found |= kept_motions(_motions(branches), notes["coordinates"])
    if "competition" in notes:
        own = notes["competition"]
        found |= {
            "time": np.asarray(own["time"]),
            "wave_amplitude": np.asarray(own["amplitude"]),
            "outcome": str(own["sentence"]),
            "outcome_missing": str(own["left_out"]),
        }
    return LimitCycles(**found)


def _with_diameters(branch: CycleBranch, sectors: int) -> CycleBranch:
    if branch.wave_number < 0:
        return branch
    return replace(branch, nodal_diameter=wave(branch.wave_number, sectors).nodal_diameter)


def _with_time(branch: CycleBranch, note: Mapping[str, Any]) -> CycleBranch:
    amplitude, omega = (np.atleast_1d(note[name]).tolist() for name in ("amplitude", "omega"))
    cycles = zip(branch.cycles, amplitude, omega, strict=True)
    return replace(branch, cycles=tuple(replace(c, time_amplitude=a, time_omega=w) for c, a, w in cycles))


def _motions(branches: Sequence[CycleBranch]) -> FloatArray:
    """Return the motions (cycles, harmonics + 1, n, 2) of all limit cycles, zero above the harmonics of each."""
    every = [cycle.coefficients for branch in branches for cycle in branch.cycles]
    if not every:
        return np.zeros((0, 1, 0, 2))
    out = np.zeros((len(every), max(len(own) for own in every), *every[0].shape[1:]))
    for row, own in zip(out, every, strict=True):
        row[: len(own)] = own
    return out
