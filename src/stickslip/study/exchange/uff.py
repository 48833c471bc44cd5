"""Universal files (UFF) for test software, written by pyuff: nodes (2411), operating deflection shapes (55), response functions (58)."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import BoolArray, IntArray
from stickslip.errors import missing_package
from stickslip.study.exchange.chosen import as_complex
from stickslip.study.exchange.motion import Motion, numbers_of
from stickslip.study.store.atomic_write import whole_file

SI = {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
DIRECTIONS = {name: k for k, name in enumerate(("x", "y", "z", "rx", "ry", "rz"), 1)}
GENERAL, RESPONSE_FUNCTION = 0, 4  # function types of dataset 58
DISPLACEMENT, FORCE, FREQUENCY = 8, 13, 18  # specific data types
NOWHERE = (0, "", 0)
AT_FREQUENCY, TRANSLATIONS = 5, 2  # types of analysis and data in dataset 55


def write_uff(motion: Motion, data: xr.Dataset | None, case: int, path: Path) -> Path:
    """Write the nodes, one shape for each harmonic, and the response of every output over frequency in each harmonic.

    Parameters
    ----------
    motion
        The motion at one point of a response, or a free motion.
    data, case
        The forced response and the index of its case; None for a free motion, which has no response functions.
    path
        The file.
    """
    try:
        import pyuff
    except ModuleNotFoundError as error:
        raise missing_package("pyuff", error, "exchange") from error
    nodes = np.concatenate(numbers_of(motion)[0])
    sets = [_units(), _nodes(motion, nodes), *_shapes(motion, nodes)]
    if data is not None:
        sets += _functions(motion, data, case)
    with whole_file(path) as temporary:
        pyuff.UFF(str(temporary)).write_sets(sets, "overwrite")
    return path


def _units() -> dict[str, Any]:
    return {"type": 164, "units_code": 1, "units_description": "SI: Meter (newton)", "temp_mode": 2} | SI


def _nodes(motion: Motion, numbers: IntArray) -> dict[str, Any]:
    x, y, z = np.vstack([body.nodes.points for body in motion.bodies]).T
    colour = np.repeat(np.arange(1, len(motion.bodies) + 1), [len(b.nodes.points) for b in motion.bodies])
    global_axes = np.zeros(numbers.size, dtype=np.int64)
    return {
        "type": 2411,
        "node_nums": numbers,
        "def_cs": global_axes,
        "disp_cs": global_axes,
        "color": colour,
        "x": x,
        "y": y,
        "z": z,
    }


def _shapes(motion: Motion, numbers: IntArray) -> Iterator[dict[str, Any]]:
    for h in (h for h in motion.harmonics if h > 0):
        x, y, z = np.vstack([body.amplitudes[h] for body in motion.bodies]).T
        yield {
            "type": 55,
            "id1": f"Operating deflection shape, harmonic {h}",
            "id2": motion.label or "NONE",
            "id3": "u(t) = Re(U exp(i 2 pi f t)), amplitude in m",
            "model_type": 1,
            "analysis_type": AT_FREQUENCY,
            "data_ch": TRANSLATIONS,
            "spec_data_type": DISPLACEMENT,
            "load_case": 1,
            "freq_step_n": h,
            "freq": h * motion.hz,
            "node_nums": numbers,
            "r1": x,
            "r2": y,
            "r3": z,
        }


def _functions(motion: Motion, data: xr.Dataset, case: int) -> Iterator[dict[str, Any]]:
    """Return the response of every output over frequency; harmonics that loads drive are per newton."""
    outputs = as_complex(data["output_displacement"].values)
    mine = (data["point_case"].values == case) & np.isfinite(outputs).any(axis=(1, 2))
    order = in_order(data, mine)
    hertz, outputs = data["frequency_hz"].values[order], np.nan_to_num(outputs[order])
    force = float(data["excitation_n"].values[case])
    driven = {int(h) for h in np.atleast_1d(data.attrs["driven_harmonics"])}
    if hertz.size < 2 or not np.isfinite(force):
        return
    numbers = _numbers(motion)
    for k, label in enumerate(str(own) for own in data["output"].values):
        point, _, component = label.rpartition(".")
        for h in range(1, outputs.shape[1]):
            values = outputs[:, h, k]
            if not np.any(values):
                continue
            function = h in driven
            yield {
                "type": 58,
                "func_type": RESPONSE_FUNCTION if function else GENERAL,
                "id1": f"{label}, harmonic {h}",
                "id2": motion.label or "NONE",
                "id3": "displacement over force amplitude" if function else "displacement",
                "id4": "over the frequency of the excitation",
                "rsp_ent_name": point[:10],
                "rsp_node": numbers.get(motion.outputs.get(label, NOWHERE), 0),
                "rsp_dir": DIRECTIONS.get(component, 0),
                "ref_ent_name": "load" if function else "NONE",
                "ref_node": 0,
                "ref_dir": 0,
                "abscissa_spacing": 0,
                "abscissa_spec_data_type": FREQUENCY,
                "abscissa_axis_lab": "Frequency",
                "abscissa_axis_units_lab": "Hz",
                "ordinate_spec_data_type": DISPLACEMENT,
                "ordinate_axis_lab": "Displacement",
                "ordinate_axis_units_lab": "rad" if component[:1] == "r" else "m",
                "orddenom_spec_data_type": FORCE if function else 0,
                "orddenom_axis_lab": "Force" if function else "NONE",
                "orddenom_axis_units_lab": "N" if function else "NONE",
                "x": hertz,
                "data": values / force if function else values,
            }


def in_order(data: xr.Dataset, mine: BoolArray) -> IntArray:
    """Return the points of a case in order of frequency, or on a folded branch along the branch without points added at the peak."""
    points = np.flatnonzero(mine)
    branch = points[data["refinement"].values[points] == 0]
    steps = np.diff(data["frequency_hz"].values[branch])
    if np.all(steps > 0) or np.all(steps < 0):
        hertz = data["frequency_hz"].values[points]
        written = [float(f"{f:.5e}") for f in hertz]  # frequencies may coincide with the digits of the format
        return np.asarray(points[np.unique(written, return_index=True)[1]])
    return np.asarray(branch)


def _numbers(motion: Motion) -> Mapping[tuple[int, str, int], int]:
    """Return the number of each node in the file, by sector, part and number in the model."""
    found: dict[tuple[int, str, int], int] = {}
    for body, numbers in zip(motion.bodies, numbers_of(motion)[0], strict=True):
        own = zip(body.nodes.numbers, numbers, strict=True)
        found |= {(body.sector, body.nodes.part, int(a)): int(b) for a, b in own}
    return found
