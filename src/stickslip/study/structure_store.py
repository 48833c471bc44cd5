"""Results of the commands for bladed disks as labelled datasets; docs/design.md has the layout."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray
from stickslip.reduction.waves import wave
from stickslip.response.rotating.safe import Safe
from stickslip.study.netcdf import variable
from stickslip.study.static_state import StaticState
from stickslip.study.structure_results import Facts, Skin, WaveBranches, WaveModes
from stickslip.study.structure_study import Command

RPM = 2 * np.pi / 60  # rad/s


@dataclass(frozen=True)
class Origin:
    """Where a result comes from, and of which wheel it is: attributes of the dataset.

    Parameters
    ----------
    command
        That made it.
    title, study_toml, stickslip_version, versions, created, wall_seconds, warnings, complete
        As in results of forced responses.
    model_hash
        Of the model; results of different models are not shown on one page.
    sectors
        Of the wheel.
    axis_direction, axis_origin
        Of the rotation; the origin in m.
    speed_rpm
        At which modes and interference were computed.
    rotation
        What of the rotation was kept, in words.
    static
        At that speed, or at the highest of a Campbell diagram; None where nothing turns.
    """

    command: Command
    title: str
    study_toml: str
    stickslip_version: str
    versions: Mapping[str, str]
    created: str
    wall_seconds: float
    warnings: Sequence[str]
    complete: bool
    model_hash: str
    sectors: int
    axis_direction: tuple[float, float, float]
    axis_origin: tuple[float, float, float]
    speed_rpm: float
    rotation: str
    static: StaticState | None

    def attributes(self, facts: Facts) -> dict[str, Any]:
        """Return them as netCDF attributes: texts and numbers only."""
        own = {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in vars(self).items()
            if name != "static"
        }
        state = self.static
        nothing = float("nan")
        own |= {
            "versions": json.dumps(dict(self.versions)),
            "warnings": json.dumps(list(self.warnings)),
            "complete": int(self.complete),
            "static_rpm": nothing if state is None else state.rpm,
            "static_displacement_m": nothing if state is None else state.displacement,
            "static_strain": nothing if state is None else state.strain,
            "static_rotation_rad": nothing if state is None else state.rotation,
        }
        return own | {
            "mass_kg": facts.mass,
            "centre_m": list(facts.centre),
            "box_low_m": list(facts.low),
            "box_high_m": list(facts.high),
            "dofs": facts.dofs,
            "nodes": facts.nodes,
            "elements": facts.elements,
        }


def modes_dataset(
    waves: Sequence[WaveModes],
    reference: FloatArray | None,
    skin: Skin | None,
    facts: Facts,
    origin: Origin,
) -> xr.Dataset:
    """Return the dataset of ``stickslip modes``.

    Parameters
    ----------
    waves
        In the order of their wave numbers.
    reference
        (k, m) frequencies in Hz to compare with, NaN where there is none; None where none were given.
    skin
        None where the model has no mesh.
    facts, origin
        Of the model and the run.
    """
    data = _wave_variables([w.wave_number for w in waves], origin.sectors)
    frequencies = np.array([w.frequencies_hz for w in waves])
    data["frequency_hz"] = variable("wave mode", frequencies, "Hz", "natural frequency")
    data["growth"] = _growth(waves)
    data["seconds"] = variable("wave", [w.seconds for w in waves], "s", "time of the computation")
    if reference is not None:
        data["reference_hz"] = variable("wave mode", reference, "Hz", "frequency to compare with")
        data["difference"] = variable(
            "wave mode", frequencies / reference - 1, "1", "relative difference from the reference"
        )
    if skin is not None and waves and waves[0].shapes.size:
        shapes = np.stack([w.shapes for w in waves])
        parts = np.stack([shapes.real, shapes.imag], axis=-1).astype(np.float32)
        data["shape"] = variable(
            "wave mode skin_point xyz part", parts, "1", "displacement of sector 0, largest is 1"
        )
        data["skin_point"] = variable("skin_point xyz", skin.points, "m", "points of the skin")
        data["skin_triangle"] = variable(
            "face corner", skin.triangles, "1", "triangles of the skin"
        )
        data["skin_cut"] = variable("face", skin.cut, "1", "1 on a cyclic face, inside the wheel")
    return _dataset(data, facts, origin, modes=frequencies.shape[-1])


def campbell_dataset(
    waves: Sequence[WaveBranches],
    speeds: FloatArray,
    engine_orders: Sequence[int],
    unfollowed: Sequence[tuple[int, float]],
    facts: Facts,
    origin: Origin,
) -> xr.Dataset:
    """Return the dataset of ``stickslip campbell``; `speeds` in rad/s, of `unfollowed` engine orders in rpm."""
    data = _wave_variables([w.wave_number for w in waves], origin.sectors)
    frequencies = np.array([w.frequencies_hz for w in waves])
    which = np.repeat(np.arange(len(waves)), [len(w.modes) for w in waves])

    def every(name: str) -> Any:
        return np.concatenate([getattr(w, name) for w in waves])

    data |= {
        "speed_rpm": variable("speed", np.asarray(speeds) / RPM, "rpm", "speed of the rotor"),
        "frequency_hz": variable(
            "wave speed mode", frequencies, "Hz", "natural frequency in the rotating frame"
        ),
        "seconds": variable("wave", [w.seconds for w in waves], "s", "time of the computation"),
        "basis_error": variable(
            "wave", [w.error for w in waves], "1", "relative error of frequencies between speeds"
        ),
        "crossing_wave": variable("crossing", which, "1", "index of the wave"),
        "crossing_mode": variable("crossing", every("modes"), "1", "index of the mode"),
        "crossing_engine_order": variable(
            "crossing", every("engine_orders"), "1", "engine order that crosses"
        ),
        "crossing_speed_rpm": variable(
            "crossing", every("speeds") / RPM, "rpm", "speed of the crossing"
        ),
        "crossing_frequency_hz": variable(
            "crossing", every("crossings_hz"), "Hz", "frequency of the crossing"
        ),
        "unfollowed_engine_order": variable(
            "unfollowed",
            np.array([m for m, _ in unfollowed], dtype=np.int64),
            "1",
            "engine order that goes beyond the followed modes of its nodal diameter",
        ),
        "unfollowed_from_rpm": variable(
            "unfollowed",
            np.array([rpm for _, rpm in unfollowed], dtype=float),
            "rpm",
            "speed from which it does",
        ),
    }
    made = _dataset(data, facts, origin, modes=frequencies.shape[-1])
    return made.assign_attrs(engine_orders=list(engine_orders))


def safe_dataset(
    waves: Sequence[WaveModes], found: Safe, facts: Facts, origin: Origin
) -> xr.Dataset:
    """Return the dataset of ``stickslip safe``: every pair of an engine order and a mode that it can excite."""
    numbers = [w.wave_number for w in waves]
    data = _wave_variables(numbers, origin.sectors)
    frequencies = np.array([w.frequencies_hz for w in waves])
    pairs = found.points
    known = [k if k in numbers else origin.sectors - k for k in (p.wave_number for p in pairs)]
    orders = np.array([p.engine_order for p in pairs])
    data |= {
        "frequency_hz": variable("wave mode", frequencies, "Hz", "natural frequency"),
        "growth": _growth(waves),
        "pair_wave": variable("pair", [numbers.index(k) for k in known], "1", "index of the wave"),
        "pair_mode": variable("pair", [p.mode for p in pairs], "1", "index of the mode"),
        "pair_engine_order": variable("pair", orders, "1", "engine order"),
        "pair_frequency_hz": variable(
            "pair", [p.frequency_hz for p in pairs], "Hz", "natural frequency of the mode"
        ),
        "pair_excitation_hz": variable(
            "pair", orders * found.speed_range[0] / (2 * np.pi), "Hz", "frequency of the excitation"
        ),
        "pair_resonance_rpm": variable(
            "pair", [p.speed / RPM for p in pairs], "rpm", "speed at which they meet"
        ),
        "pair_margin": variable(
            "pair", [p.margin for p in pairs], "1", "that speed over the speed, less one"
        ),
        "pair_near": variable(
            "pair",
            [int(abs(p.margin) <= found.allowed) for p in pairs],
            "1",
            "1 if the margin is within the limit",
        ),
        "pair_judged": variable(
            "pair",
            [int(m not in found.not_judged) for m in orders],
            "1",
            "0 if the engine order excites above the highest computed mode of its nodal diameter",
        ),
    }
    made = _dataset(data, facts, origin, modes=frequencies.shape[-1])
    return made.assign_attrs(margin_percent=100 * found.allowed)


def _wave_variables(numbers: Sequence[int], sectors: int) -> dict[str, xr.Variable]:
    named = [wave_name(k, sectors) for k in numbers]
    return {
        "wave_number": variable("wave", list(numbers), "1", "wave number of the travelling wave"),
        "nodal_diameter": variable("wave", [d for d, _ in named], "1", "nodal diameter"),
        "wave_kind": variable(
            "wave", [kind for _, kind in named], "1", "standing, forward or backward"
        ),
    }


def _growth(waves: Sequence[WaveModes]) -> xr.Variable:
    grown = np.array([w.growth for w in waves])
    return variable(
        "wave mode", grown, "1", "derivative of the squared frequency by the squared speed"
    )


def wave_name(number: int, sectors: int) -> tuple[int, str]:
    """Return the nodal diameter of a wave number, and its kind."""
    if sectors == 1:
        return 0, "whole"
    found = wave(number, sectors)
    return found.nodal_diameter, found.kind


def _dataset(
    data: dict[str, xr.Variable], facts: Facts, origin: Origin, *, modes: int
) -> xr.Dataset:
    coordinates = {
        "mode": np.arange(1, modes + 1),
        "xyz": ["x", "y", "z"],
        "part": ["re", "im"],
    }
    used = {dim for variable in data.values() for dim in variable.dims}
    return xr.Dataset(
        data,
        coords={k: v for k, v in coordinates.items() if k in used},
        attrs=origin.attributes(facts),
    )
