"""A synthetic forced response for tests of the report: the dataset contract of docs/design.md, filled with a toy model.

One bending mode carries a Jenkins spring whose limit follows the load ratio (harmonic linearisation), and nine contact
points are marched in time with a variable normal load. The numbers are plausible; nothing here is a prediction.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray, IntArray
from stickslip.study.store.netcdf import write_tree

CENTRIFUGAL = 400.0  # N
MODAL_MASS = 2.0  # kg
FREE_HZ, STUCK_HZ = 166.0, 188.0
LOSS = 0.004  # structural loss, to keep the peak finite
FRICTION = 0.6
K_TANGENT, K_NORMAL = 8.0e6, 9.0e6  # N/m a point
SAMPLES = 128
CONTACTS = tuple(f"{line}.{section}" for line in ("L1", "L2", "R") for section in (1, 2, 3))
OUTPUTS = ("tip1.x", "tip1.y", "tip2.x")
DAMPER = tuple(f"damper.{c}" for c in ("x", "y", "z", "rx", "ry", "rz"))
RETAINED = (*(f"blades.{name}.{c}" for name in CONTACTS for c in "xyz"), *DAMPER)
HIGH = 5
KEY = "load.shaker.ratio"
DIRECTIONS = ["t", "w", "n"]


def jenkins(amplitude: FloatArray, stiffness: float, limit: float) -> FloatArray:
    """Complex stiffness of a Jenkins spring under a harmonic motion (describing function)."""
    ratio = np.minimum(1.0, limit / (stiffness * amplitude))
    theta = np.arccos(1 - 2 * ratio)
    real = stiffness * (theta - 0.5 * np.sin(2 * theta)) / np.pi
    loss = 4 * limit * (1 - ratio) / (np.pi * amplitude)
    return real + 1j * loss


def response(hz: FloatArray, excitation: float, ratio: float) -> FloatArray:
    """Tip amplitude in m at each frequency: bisection on the amplitude."""
    spring = MODAL_MASS * (2 * np.pi) ** 2 * (STUCK_HZ**2 - FREE_HZ**2)
    limit = 0.3 * ratio * excitation
    low, high = np.full(hz.shape, 1e-9), np.full(hz.shape, 1e-1)
    for _ in range(60):
        middle = np.sqrt(low * high)
        free = MODAL_MASS * (2 * np.pi) ** 2 * (FREE_HZ**2 * (1 + 1j * LOSS) - hz**2)
        over = np.abs(free + jenkins(middle, spring, limit)) * middle > excitation
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    return low


def march(gap: FloatArray, preload: FloatArray) -> tuple[FloatArray, IntArray]:
    """Force and state (0 stick, 1 slip, 2 open) of elastic Coulomb points over the last of two periods.

    `gap` is (..., contact, 3, sample); returns force of that shape and state (..., contact, 2, sample).
    """
    normal = np.maximum(0.0, preload[:, None] - K_NORMAL * gap[..., 2, :])
    tangent = gap[..., :2, :]
    force = np.zeros_like(gap)
    state = np.zeros(tangent.shape, dtype=np.int64)
    spring, previous = K_TANGENT * tangent[..., 0], tangent[..., 0]
    for step in range(2 * gap.shape[-1]):
        k = step % gap.shape[-1]
        trial = spring + K_TANGENT * (tangent[..., k] - previous)
        limit = FRICTION * normal[..., None, k]
        spring, previous = np.clip(trial, -limit, limit), tangent[..., k]
        state[..., k] = np.where(limit <= 0, 2, np.where(np.abs(trial) > limit, 1, 0))
        force[..., :2, k] = spring
    force[..., 2, :] = -normal
    return force, state


def contact_motion(amplitude: FloatArray) -> FloatArray:
    """Gaps (point, contact, 3, sample) in m that go with a tip amplitude (point,)."""
    phase = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    contact = np.arange(len(CONTACTS))
    share = 0.006 * (1 + 0.12 * np.sin(1.7 * contact))[:, None]
    lag = 0.25 * contact[:, None]
    wave = np.stack(
        [
            share * np.cos(phase - 0.1 * lag),
            0.25 * share * np.cos(phase + lag),
            0.35 * share * np.cos(phase + 0.8 + 0.2 * lag),
        ],
        axis=1,
    )
    return np.asarray(amplitude[:, None, None, None] * wave)


def fourier(signal: FloatArray) -> FloatArray:
    """Coefficients 0..HIGH of the last axis, as (point, harmonic, ..., part)."""
    q = 2 * np.fft.rfft(signal, axis=-1)[..., : HIGH + 1] / signal.shape[-1]
    q[..., 0] /= 2
    return parts(np.moveaxis(q, -1, 1))


def parts(values: np.ndarray) -> FloatArray:
    """Complex array with a trailing dimension (re, im)."""
    return np.stack([values.real, values.imag], axis=-1)


def box(lower: Sequence[float], upper: Sequence[float], n: Sequence[int]) -> tuple[FloatArray, IntArray]:
    """Triangulated surface of a box."""
    points, faces, start = [], [], 0
    for axis in range(3):
        u, v = [a for a in range(3) if a != axis]
        for end in (lower[axis], upper[axis]):
            grid = np.meshgrid(
                np.linspace(lower[u], upper[u], n[u] + 1), np.linspace(lower[v], upper[v], n[v] + 1), indexing="ij"
            )
            patch = np.empty((grid[0].size, 3))
            patch[:, axis], patch[:, u], patch[:, v] = end, grid[0].ravel(), grid[1].ravel()
            i, j = np.meshgrid(np.arange(n[u]), np.arange(n[v]), indexing="ij")
            a = (i * (n[v] + 1) + j).ravel() + start
            b = a + n[v] + 1
            faces += [np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)]
            points.append(patch)
            start += len(patch)
    return np.vstack(points), np.vstack(faces)


def blades() -> tuple[FloatArray, IntArray]:
    """Skin of two blades made of boxes: foot, plate that tapers, platform."""
    points, faces, start = [], [], 0
    for centre in (0.0, 0.06):
        for lower, upper, n in (
            ((-0.02, -0.025, 0.0), (0.02, 0.025, 0.03), (8, 10, 6)),
            ((-0.004, -0.02, 0.03), (0.004, 0.02, 0.22), (2, 8, 38)),
            ((-0.024, -0.022, 0.075), (0.024, 0.022, 0.082), (10, 9, 2)),
        ):
            p, f = box(lower, upper, n)
            taper = np.where(p[:, 2] > 0.09, 1 - 3 * (p[:, 2] - 0.09), 1.0)
            p[:, 0] = p[:, 0] * taper + centre
            points.append(p)
            faces.append(f + start)
            start += len(p)
    return np.vstack(points), np.vstack(faces)


def contact_geometry() -> tuple[FloatArray, FloatArray]:
    """Positions (9, 3) and frames (9, 3, 3) of the contact points."""
    y = np.array([-0.012, 0.0, 0.012])
    lines = {"L1": (0.026, 0.073, -1), "L2": (0.021, 0.068, -1), "R": (0.0345, 0.0705, 1)}
    position = np.array([(x, yk, z) for x, z, _ in lines.values() for yk in y])
    half = np.sqrt(0.5)
    frames = []
    for _, _, side in lines.values():
        n = np.array([side * half, 0, half])
        w = np.array([0.0, 1.0, 0.0])
        frames += [np.stack([np.cross(w, n), w, n], axis=1)] * 3
    return position, np.array(frames)


def branch(ratio: float, n: int, failed: int) -> dict[str, np.ndarray]:
    """One load case: the branch, then three points that refine its peak."""
    hz = np.linspace(155.0, 200.0, n)
    excitation = CENTRIFUGAL / ratio
    coarse = response(hz, excitation, ratio)
    fine = hz[np.argmax(coarse)] + np.array([-0.3, 0.1, 0.4])
    refinement = np.repeat([0, 1], [n, 3])
    hz = np.concatenate([hz, fine])
    amplitude = response(hz, excitation, ratio)
    error = 70.0 / (1 + (ratio / 4) ** 4) * (coarse.max() / amplitude) ** -1.6
    error = np.where(error > 1e-3, error, 1e-12)
    order = np.where(error > 5.0, HIGH, 1)
    real = np.where(order == HIGH, 0.8 * error * (1 + 0.3 * np.cos(hz)), np.nan)
    low = amplitude * (1 - np.nan_to_num(real) / 100)
    error[refinement == 1], real[refinement == 1], low[refinement == 1] = np.nan, np.nan, np.nan
    status = np.zeros(n + 3, dtype=np.int64)
    status[n // 2 : n // 2 + failed] = 1
    return {
        "frequency_hz": hz,
        "amplitude": amplitude,
        "amplitude_low": low,
        "order": order,
        "predicted_error_percent": error,
        "real_error_percent": real,
        "refinement": refinement,
        "status": status,
    }


def _variable(dims: str, values: object, units: str, long_name: str) -> xr.Variable:
    attributes = {"units": units, "long_name": long_name}
    return xr.Variable(tuple(dims.split()), np.asarray(values), attributes)


def _case_variables(table: dict[str, np.ndarray], ratios: FloatArray, peak: IntArray) -> dict[str, xr.Variable]:
    case, status, order = table["point_case"], table["status"], table["order"]
    cases = range(len(ratios))

    def count(mask: np.ndarray) -> list[int]:
        return [int(np.sum(mask & (case == i))) for i in cases]

    found = peak >= 0
    seconds = np.array(count(case >= 0)) * 0.004
    counts = {
        "points": count(case >= 0),
        "points_low": count(order == 1),
        "points_high": count(order == HIGH),
        "points_failed": count(status != 0),
        "newton_steps": count(case >= 0),
    }
    peaks = {
        "peak_amplitude": ("m", np.where(found, table["amplitude"][peak], np.nan)),
        "peak_frequency_hz": ("Hz", np.where(found, table["frequency_hz"][peak], np.nan)),
        "retention_peak_shift": ("1", 0.002 / ratios),
        "retention_frequency_shift_hz": ("Hz", 0.01 / ratios),
        "seconds_contact": ("s", seconds),
        "seconds_linear": ("s", 1.4 * seconds),
        "seconds_rest": ("s", 0.3 * seconds),
        "excitation_n": ("N", CENTRIFUGAL / ratios),
    }
    result = {k: _variable("case", v, u, k.replace("_", " ")) for k, (u, v) in peaks.items()}
    result |= {k: _variable("case", v, "1", k.replace("_", " ")) for k, v in counts.items()}
    result["peak_point"] = _variable("case", peak, "1", "index of the peak into point")
    return result


def _retained(table: dict[str, np.ndarray]) -> np.ndarray:
    """Retained coordinates (point, harmonic, retained): only the damper moves."""
    amplitude, n = table["amplitude"], len(table["point_case"])
    retained = np.zeros((n, HIGH + 1, len(RETAINED)), dtype=complex)
    six = np.array([0.03, 0.002, 0.02j, 0.05, 0.8 + 0.3j, 0.1])
    retained[:, 1, -6:] = amplitude[:, None] * six
    retained[:, 3, -6:] = 0.05 * amplitude[:, None] * six * (table["order"] == HIGH)[:, None]
    retained[:, 0, -6:-3] = 1e-5
    return retained


def _point_variables(table: dict[str, np.ndarray], preload: FloatArray) -> dict[str, xr.Variable]:
    amplitude, n = table["amplitude"], len(table["point_case"])
    gap = contact_motion(amplitude)
    force, _ = march(gap, preload)
    energy = np.sum(force[..., :2, :] * (np.roll(gap, -1, -1) - gap)[..., :2, :], axis=(-1, -2))
    share = np.array([1.0, 0.04, 0.7])
    output = np.zeros((n, HIGH + 1, len(OUTPUTS)), dtype=complex)
    output[:, 1] = amplitude[:, None] * share
    units = {"frequency_hz": "Hz", "predicted_error_percent": "percent", "real_error_percent": "percent"}
    plain = (
        "point_case",
        "frequency_hz",
        "order",
        "status",
        "predicted_error_percent",
        "real_error_percent",
        "refinement",
    )
    result = {k: _variable("point", table[k], units.get(k, "1"), k.replace("_", " ")) for k in plain}
    result["status"].attrs |= {"flag_values": [0, 1, 2], "flag_meanings": "converged max_iterations small_step"}
    return result | {
        "newton_iterations": _variable("point", np.full(n, 4), "1", "Newton iterations"),
        "seconds": _variable("point", np.full(n, 0.011), "s", "time of the point"),
        "amplitude": _variable("point output", amplitude[:, None] * share, "m", "first harmonic"),
        "amplitude_low": _variable(
            "point output", table["amplitude_low"][:, None] * share, "m", "first harmonic at low order"
        ),
        "output_displacement": _variable("point harmonic output part", parts(output), "m", "output"),
        "retained_displacement": _variable("point harmonic retained part", parts(_retained(table)), "m", "retained"),
        "gap": _variable("point harmonic contact direction part", fourier(gap), "m", "contact gap"),
        "contact_force": _variable("point harmonic contact direction part", fourier(force), "N", "force"),
        "dissipated_energy": _variable("point contact", energy, "J", "energy lost in a cycle"),
        "harmonic_kept": _variable("point harmonic", np.arange(HIGH + 1) <= table["order"][:, None], "1", "kept"),
    }


def _peak_variables(table: dict[str, np.ndarray], peak: IntArray, preload: FloatArray) -> dict[str, xr.Variable]:
    gap = contact_motion(table["amplitude"][peak])
    force, state = march(gap, preload)
    time = np.arange(SAMPLES) / SAMPLES / table["frequency_hz"][peak][:, None]
    missing = peak < 0
    for values in (gap, force, time):
        values[missing] = np.nan
    result = {
        "peak_time": _variable("case sample", time, "s", "time in the period"),
        "peak_gap": _variable("case contact direction sample", gap, "m", "gap at the peak"),
        "peak_force": _variable("case contact direction sample", force, "N", "force at the peak"),
        "peak_state": _variable("case contact tangent sample", state, "1", "state at the peak"),
    }
    result["peak_state"].attrs |= {"flag_values": [0, 1, 2], "flag_meanings": "stick slip open"}
    return result


def _model_variables(preload: FloatArray) -> dict[str, xr.Variable]:
    position, frame = contact_geometry()
    points, faces = blades()
    static = np.zeros((len(CONTACTS), 3))
    full = np.array([165.98, 166.41, 512.3, 514.9, 930.1])
    stuck = np.array([171.2, 188.03, 540.8, 561.2, 988.7])
    slack = 1 + np.array([1e-6, 2e-6, 1e-5, 4e-5, 2e-4])
    modes = {
        "frequency_full_hz": full,
        "frequency_reduced_hz": full * slack,
        "frequency_stuck_full_hz": stuck,
        "frequency_stuck_reduced_hz": stuck * slack,
    }
    result = {k: _variable("mode", v, "Hz", k.replace("_", " ")) for k, v in modes.items()}
    return result | {
        "contact_law": _variable("contact", ["elastic_coulomb"] * 9, "1", "law"),
        "contact_group": _variable("contact", ["flat"] * 6 + ["curved"] * 3, "1", "contact"),
        "static_gap": _variable("contact direction", static, "m", "gap of the static solve"),
        "static_force": _variable("contact direction", static - [0, 0, 1] * preload[:, None], "N", "static force"),
        "contact_position": _variable("contact xyz", position, "m", "contact point"),
        "contact_frame": _variable("contact xyz direction", frame, "1", "contact frame"),
        "surface_point": _variable("surface_node xyz", points, "m", "skin of the blades"),
        "surface_triangle": _variable("face corner", faces, "1", "triangles of the skin"),
    }


def _check_variables(table: dict[str, np.ndarray], n_cases: int) -> dict[str, xr.Variable]:
    case = np.full(3, n_cases - 1)
    at = np.array([5, 20, 30]) % int(np.sum(table["point_case"] == n_cases - 1))
    first = int(np.argmax(table["point_case"] == n_cases - 1))
    balance = table["amplitude"][first + at]
    return {
        "verify_case": _variable("check", case, "1", "load case"),
        "verify_frequency_hz": _variable("check", table["frequency_hz"][first + at], "Hz", "frequency"),
        "verify_transient": _variable("check", 1.004 * balance, "m", "amplitude by integration"),
        "verify_balance": _variable("check", balance, "m", "amplitude by balance"),
        "verify_difference_percent": _variable("check", np.full(3, -0.4), "percent", "difference"),
        "verify_settled": _variable("check", [1, 1, 1], "1", "settled"),
        "verify_periods": _variable("check", [60, 210, 90], "1", "periods integrated"),
    }


def _attributes() -> dict[str, object]:
    return {
        "selection": "jacobian_alert",
        "alert_threshold_percent": 5.0,
        "low_order": 1,
        "high_order": HIGH,
        "low_harmonics": [0, 1],
        "high_harmonics": list(range(HIGH + 1)),
        "selection_threshold": 0.05,
        "failed": 0,
        "samples": SAMPLES,
        "report_output": "tip1.x",
        "error_over": "tip1.x",
        "alert_explanation": "One Newton step with harmonics 0 to 5 moves the outputs by more than 5 %.",
    }


def provenance(**more: object) -> dict[str, object]:
    """Return the attributes of the root."""
    study = 'schema_version = 2\n[damper]\nmass_kg = 0.02  # "flat" & <curved>\n'
    return {
        "title": "Two blades, one damper <synthetic>",
        "stickslip_version": "0.1.0",
        "study_toml": study,
        "versions": json.dumps({"numpy": "2.4", "scipy": "1.17"}),
        "created": "2026-01-01T00:00:00+00:00",
        "wall_seconds": 12.3,
        "complete": 1,
    } | more


def labelled(data: xr.Dataset, key: str, values: Sequence[float]) -> xr.Dataset:
    """Add what the runner adds to the node of an analysis: the varied key and the label of each case."""
    labels = [f"{key} = {v:g}" for v in values]
    rows = _variable("case vary", np.array(values, dtype=float)[:, None], "1", "values")
    data = data.assign(case_label=_variable("case", labels, "1", "what is varied"), vary_value=rows)
    return data.assign_coords(vary=[key])


def synthetic_result(
    ratios: Sequence[float] = (200, 50, 20, 10, 5, 3.5, 2), n: int = 46, failed: int = 0, verify: bool = True
) -> xr.Dataset:
    """Build the node ``forced_response``; `failed` points in the middle of the last load case did not converge."""
    runs = [branch(r, n, failed if i == len(ratios) - 1 else 0) for i, r in enumerate(ratios)]
    table = {k: np.concatenate([run[k] for run in runs]) for k in runs[0]}
    table["point_case"] = np.repeat(np.arange(len(ratios)), [len(run["order"]) for run in runs])
    amplitude = np.where(table["status"] == 0, table["amplitude"], -1)
    peak = np.array([np.argmax(np.where(table["point_case"] == i, amplitude, -2)) for i in range(len(ratios))])
    preload = CENTRIFUGAL / np.array([8.0] * 3 + [16.0] * 3 + [6.0] * 3)
    preload *= np.tile([1.1, 1.0, 0.9], 3) / 3 * 2
    variables = _case_variables(table, np.array(ratios, dtype=float), peak)
    variables |= _point_variables(table, preload) | _peak_variables(table, peak, preload)
    variables |= _model_variables(preload)
    if verify:
        variables |= _check_variables(table, len(ratios))
    coordinates = {
        "output": list(OUTPUTS),
        "contact": list(CONTACTS),
        "retained": list(RETAINED),
        "harmonic": np.arange(HIGH + 1),
        "direction": DIRECTIONS,
        "tangent": DIRECTIONS[:2],
        "part": ["re", "im"],
        "xyz": ["x", "y", "z"],
    }
    return labelled(xr.Dataset(variables, coords=coordinates, attrs=_attributes()), KEY, ratios)


def tree_of(root: dict[str, object] | None = None, **nodes: xr.Dataset) -> xr.DataTree:
    """Put analyses together as the runner does."""
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root or provenance()), **nodes})


def write_result(tree: xr.DataTree, path: Path) -> Path:
    """Write a result as netCDF-4 and return the path."""
    write_tree(tree, path)
    return path
