"""Records of the analyses by waves: a record for each wave, and the record of a case; wave numbers and their names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from stickslip.analyses.facts import ModelFacts
from stickslip.analyses.operation import InOperation, Met
from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.column import column, rows
from stickslip.errors import input_error
from stickslip.reduction.waves import excited_wave, wave

_IN_FLOW = "of the eigenvalue with aerodynamic forces and the structure's damping"
_OF_WHEEL = "of a mode of the wheel whose sectors differ, in the flow with its own damping"
_SHARE = "share of the kinetic energy of a mode of the wheel"


@dataclass(frozen=True, eq=False, kw_only=True)
class Wave:
    """A travelling wave; the dataset adds nodal diameter and kind to the record of a job."""

    wave_number: int = column("1", "wave number of the travelling wave")
    nodal_diameter: int = column("1", "nodal diameter", default=0)
    kind: str = column("1", "standing, forward or backward", "wave_kind", default="")
    seconds: float = column("s", "time of the computation")


@dataclass(frozen=True, eq=False, kw_only=True)
class WaveModes(Wave):
    """Modes of one travelling wave.

    Attributes
    ----------
    frequencies_hz
        (m,) ascending, Hz.
    growth
        (m,) derivatives of ω² with respect to Ω² at the speed; zeros for a model that does not depend on speed.
    shares, stiffest_hz
        (m, stages) and (m,); None for a single wheel.
    damping, damped_hz
        (m,); None for a model without aerodynamic forces.
    shape
        (m, n, 3, 2) real and imaginary parts of `shapes`.
    shapes
        (m, n, 3) complex displacements of the skin's points, the largest of length 1; n = 0 if not requested. A result
        has `shape` instead.
    """

    frequencies_hz: FloatArray = column("Hz", "natural frequency", "frequency_hz", along="mode")
    growth: FloatArray = column("1", "derivative of the squared frequency by the squared speed", along="mode")
    shares: FloatArray | None = column(
        "1", "share of a stage in the kinetic energy", "stage_share", along="mode stage", default=None
    )
    stiffest_hz: FloatArray | None = column(
        "Hz", "natural frequency with all harmonics held that flanges do not couple", along="mode", default=None
    )
    damping: FloatArray | None = column("1", f"damping ratio {_IN_FLOW}", along="mode", default=None)
    damped_hz: FloatArray | None = column("Hz", f"frequency {_IN_FLOW}", along="mode", default=None)
    reference_hz: FloatArray | None = column("Hz", "frequency to compare with", along="mode", default=None)
    difference: FloatArray | None = column("1", "relative difference from the reference", along="mode", default=None)
    shape: FloatArray | None = column(
        "1", "displacement of sector 0, largest is 1", along="mode skin_point xyz part", default=None
    )
    shapes: ComplexArray = field(default_factory=lambda: np.zeros((0, 0, 3), dtype=complex))


@dataclass(frozen=True, eq=False, kw_only=True)
class WheelMode:
    """A mode of a mistuned wheel."""

    frequency_hz: float = column("Hz", "natural frequency of the wheel whose sectors differ", "mistuned_hz")
    sector_share: FloatArray = column("1", f"{_SHARE} in each sector", along="blade")
    wave_share: FloatArray = column("1", f"{_SHARE} in each wave number", along="wave_of_wheel")
    localisation: float = column(
        "1", "localisation factor: 0 where all blades move alike, 1 where one moves alone", "mode_localisation"
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Modes(ModelFacts):
    """Natural frequencies and mode shapes of a case."""

    waves: tuple[WaveModes, ...] = rows("wave")
    wheel_modes: tuple[WheelMode, ...] = rows("wheel_mode")


@dataclass(frozen=True, eq=False, kw_only=True)
class Crossing:
    """A crossing of a mode with an engine order."""

    mode: int = column("1", "index of the mode")
    engine_order: int = column("1", "engine order that crosses")
    speed_rpm: float = column("rpm", "speed of the crossing")
    frequency_hz: float = column("Hz", "frequency of the crossing")


@dataclass(frozen=True, eq=False, kw_only=True)
class WaveBranches(Wave):
    """Frequencies of one travelling wave against speed, columns by mode shapes, and their crossings with engine orders."""

    frequencies_hz: FloatArray = column(
        "Hz", "natural frequency in the rotating frame", "frequency_hz", along="speed mode"
    )
    error: float = column("1", "relative error of frequencies between speeds", "basis_error")
    crossings: tuple[Crossing, ...] = rows("crossing", "crossing_", "index of the wave", always=True)


@dataclass(frozen=True, eq=False, kw_only=True)
class Unfollowed:
    """An engine order that rises above all followed modes of its wave."""

    engine_order: int = column("1", "engine order that goes beyond the followed modes of its nodal diameter")
    from_rpm: float = column("rpm", "speed from which it does")


@dataclass(frozen=True, eq=False, kw_only=True)
class Campbell(ModelFacts, InOperation):
    """Campbell diagram of a case."""

    speeds_rpm: FloatArray = column("rpm", "speed of the rotor", "speed_rpm", along="speed")
    waves: tuple[WaveBranches, ...] = rows("wave")
    engine_orders: IntArray = column("1", "engine order whose crossings are looked for", along="order")
    unfollowed: tuple[Unfollowed, ...] = rows("unfollowed", "unfollowed_", always=True)

    @property
    def met(self) -> list[Met]:
        """All crossings by name."""
        names = labels(self)
        return [
            Met(f"EO {c.engine_order} with {names[w]}, mode {c.mode + 1}", c.engine_order, c.speed_rpm)
            for w, c in self.crossings
        ]

    @property
    def crossings(self) -> list[tuple[int, Crossing]]:
        """All crossings, each with the index of its wave."""
        return [(i, crossing) for i, own in enumerate(self.waves) for crossing in own.crossings]


@dataclass(frozen=True, eq=False, kw_only=True)
class WaveFlutter(Wave):
    """Modes of a wave in the flow.

    Attributes
    ----------
    amplitudes
        (n, m) amplitudes of the patterns in each mode.
    """

    frequencies_hz: FloatArray = column("Hz", "natural frequency in still fluid", "frequency_hz", along="mode")
    phase_angle_deg: float = column("deg", "inter-blade phase angle")
    by_energy: FloatArray = column(
        "1", "aerodynamic damping ratio by the energy method", "damping_by_energy", along="mode"
    )
    by_eigenvalue: FloatArray = column(
        "1", "aerodynamic damping ratio of the eigenvalue", "damping_by_eigenvalue", along="mode"
    )
    damping: FloatArray = column("1", "damping ratio of the eigenvalue, structural damping included", along="mode")
    in_flow_hz: FloatArray = column(
        "Hz", "frequency of the eigenvalue, with that damping", "frequency_in_flow_hz", along="mode"
    )
    amplitudes: ComplexArray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))


@dataclass(frozen=True, eq=False, kw_only=True)
class WheelFlutter:
    """A mode of a mistuned wheel in the flow."""

    damping: float = column("1", f"damping ratio {_OF_WHEEL}")
    frequency_hz: float = column("Hz", f"frequency {_OF_WHEEL}")


@dataclass(frozen=True, eq=False, kw_only=True)
class Flutter(ModelFacts):
    """Flutter margins of a case; of a mistuned wheel the least damped mode first."""

    waves: tuple[WaveFlutter, ...] = rows("wave")
    curve_angle_deg: FloatArray = column("deg", "inter-blade phase angle of the curve", along="curve")
    curve_damping: FloatArray = column(
        "1", "aerodynamic damping ratio by the energy method, over any inter-blade phase angle", along="mode curve"
    )
    least_wave: int = column("1", "index of the least stable wave")
    least_mode: int = column("1", "index of its mode")
    required_damping: float = column("1", "damping ratio that every wave must have")
    wheel_modes: tuple[WheelFlutter, ...] = rows("wheel_mode", "wheel_")

    @property
    def damping(self) -> FloatArray:
        """(w, n) damping ratios of all waves, structural damping included."""
        return np.array([w.damping for w in self.waves])


@dataclass(frozen=True, eq=False, kw_only=True)
class Pair:
    """An engine order, and a mode that it can excite."""

    wave: int = column("1", "index of the wave")
    mode: int = column("1", "index of the mode")
    engine_order: int = column("1", "engine order")
    frequency_hz: float = column("Hz", "natural frequency of the mode")
    excitation_hz: float = column("Hz", "frequency of the excitation")
    resonance_rpm: float = column("rpm", "speed at which they meet")
    margin: float = column("1", "that speed over the speed, less one")
    near: bool = column("1", "1 if the margin is within the limit")
    judged: bool | None = column(
        "1", "0 if the engine order excites above the highest computed mode of its nodal diameter", default=None
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Interference(ModelFacts, InOperation):
    """SAFE diagram of a case."""

    waves: tuple[WaveModes, ...] = rows("wave")
    margin_percent: float = column("%", "margin of a near resonance")
    pairs: tuple[Pair, ...] = rows("pair", "pair_")

    @property
    def met(self) -> list[Met]:
        """All pairs that meet at some speed, by name."""
        names = labels(self)
        return [
            Met(f"EO {p.engine_order} with {names[p.wave]}, mode {p.mode + 1}", p.engine_order, p.resonance_rpm)
            for p in self.pairs
            if np.isfinite(p.resonance_rpm)
        ]


OfWaves = Modes | Campbell | Flutter | Interference

_STATES = {
    "static": "contacts stuck where pressed at rest",
    "stuck": "all contacts stuck",
    "open": "contacts open",
}


def contact_state(contacts: str | None) -> str:
    """Return the state of the contacts in small vibrations, in words, from `ModelFacts.contacts`; empty without contacts."""
    return _STATES.get(contacts or "", "")


def with_contacts(text: str, contacts: str | None) -> str:
    """Return a heading or a part of a sentence followed by the state of the contacts."""
    return ", ".join(filter(None, (text, contact_state(contacts))))


def states_that_differ(states: Mapping[str, str]) -> str:
    """Return a sentence on analyses of one model with different contact states; empty if all have the same.

    Parameters
    ----------
    states
        Name of the table of an analysis -> its `contacts`.
    """
    groups: dict[str, list[str]] = {}
    for name, state in states.items():
        if contact_state(state):
            groups.setdefault(contact_state(state), []).append(f"[{name}]")
    told = [f"{' and '.join(names)} {'has' if len(names) == 1 else 'have'} {state}" for state, names in groups.items()]
    return f"{'; '.join(told)}: the same mode has another frequency there" if len(told) > 1 else ""


def hertz(found: Modes | Flutter | Interference) -> FloatArray:
    """Return (w, m) the frequencies of all waves in Hz."""
    return np.array([w.frequencies_hz for w in found.waves])


@dataclass(frozen=True)
class Wheel:
    """Properties of a wheel that define its wave numbers.

    Parameters
    ----------
    sectors
        Number of sectors; 1 for a whole structure.
    parted
        Whether Coriolis forces split the two directions of a nodal diameter.
    """

    sectors: int
    parted: bool

    def numbers(self, diameters: Sequence[int] | None = None) -> tuple[int, ...]:
        """Return the wave numbers of nodal diameters (all if None); with split directions also the forward waves."""
        half = self.sectors // 2
        found = sorted(range(half + 1) if diameters is None else diameters)
        if self.parted:
            found += [self.sectors - d for d in reversed(found) if 0 < 2 * d < self.sectors]
        return tuple(found)

    def diagram(self, engine_order: int) -> int:
        """Return the wave number whose diagram holds the crossings of an engine order."""
        excited = excited_wave(engine_order, self.sectors)
        # without a split, both directions have the same frequencies, and one diagram
        return excited if self.parted else min(excited, self.sectors - excited)

    def require(self, diameters: Sequence[int] | None, key: str) -> None:
        """Refuse nodal diameters that the wheel lacks."""
        highest = self.sectors // 2
        if diameters and self.sectors == 1 and max(diameters) > 0:
            raise input_error(key, "are of a wheel, and no part is a sector of one", "Leave them out.")
        if diameters and max(diameters) > highest:
            raise input_error(
                key,
                f"{max(diameters)} is above half of {self.sectors} sectors",
                f"The nodal diameters go from 0 to {highest}.",
            )


def wave_name(number: int, sectors: int) -> tuple[int, str]:
    """Return the nodal diameter of a wave number, and its kind."""
    if sectors == 1:
        return 0, "whole"
    found = wave(number, sectors)
    return found.nodal_diameter, found.kind


def label(number: int, sectors: int, *, parted: bool) -> str:
    """Return the name of a wave, with its direction if the two differ."""
    diameter, kind = wave_name(number, sectors)
    if sectors == 1:
        return "whole"
    told = parted and kind in ("backward", "forward")
    return f"ND {diameter} {kind}" if told else f"ND {diameter}"


def is_parted(waves: Sequence[Wave]) -> bool:
    """Whether the two directions of a nodal diameter differ."""
    return any(w.kind == "forward" for w in waves)


def labels(found: OfWaves) -> list[str]:
    """Return the names of all waves, with the direction if the two differ."""
    return [label(w.wave_number, found.sectors or 1, parted=is_parted(found.waves)) for w in found.waves]


def stages(found: Modes) -> list[str]:
    """Return the names of the stages with their numbers of sectors; none for a single wheel."""
    if found.stage_sectors is None:
        return []
    return [f"{name} ({count} sectors)" for name, count in zip(found.stage_name, found.stage_sectors, strict=True)]
