"""Results of bladed disks made from formulas: a ring of eight flat sectors whose modes are cosines."""

import numpy as np
import xarray as xr

from stickslip.study.store.netcdf import stacked

SECTORS, MODES = 8, 3
PITCH = 2 * np.pi / SECTORS


def skin(n: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Return points and triangles of a flat piece of a ring."""
    radius, angle = np.meshgrid(np.linspace(0.1, 0.2, n), np.linspace(-PITCH / 2, PITCH / 2, n))
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * radius], axis=-1)
    at = np.arange(n * n).reshape(n, n)
    corners = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    a, b, c, d = (part.ravel() for part in corners)
    triangles = np.vstack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return points.reshape(-1, 3), triangles


def variable(dims: str, values: object, units: str = "1", name: str = "") -> xr.Variable:
    return xr.Variable(tuple(dims.split()), np.asarray(values), {"units": units, "long_name": name})


def waves(numbers: list[int]) -> dict[str, xr.Variable]:
    kinds = ["standing" if k in (0, SECTORS // 2) else "forward" for k in numbers]
    return {
        "wave_number": variable("wave", numbers),
        "nodal_diameter": variable("wave", [min(k, SECTORS - k) for k in numbers]),
        "wave_kind": variable("wave", kinds),
    }


def facts(**more: object) -> dict[str, xr.Variable]:
    """Return what results of waves say of the model."""
    numbers = {
        "sectors": SECTORS,
        "axis_direction": [0.0, 0.0, 1.0],
        "axis_origin": [0.0, 0.0, 0.0],
        "speed_rpm": 6000.0,
        "rotation": "6000 rpm, consistent tangent",
        "contacts": "none",
        "mass_kg": 0.25,
        "centre_m": [0.15, 0.0, 0.0],
        "box_low_m": [0.09, -0.08, 0.0],
        "box_high_m": [0.2, 0.08, 0.01],
        "dofs": 108,
        "nodes": 36,
        "elements": 50,
    } | more
    return {k: variable("xyz" if isinstance(v, list) else "", v) for k, v in numbers.items()}


def node(*cases: dict[str, xr.Variable]) -> xr.Dataset:
    """Return the node of an analysis with the variables of its cases."""
    data = xr.Dataset(stacked(cases))
    return data.assign(case_label=variable("case", [""] * len(cases)))


def frequency(k: np.ndarray, mode: np.ndarray, rpm: np.ndarray | float = 6000.0) -> np.ndarray:
    """Return the frequencies of the ring in Hz, from a formula."""
    return np.sqrt((100.0 * (mode + 1) * (1 + 0.3 * k)) ** 2 + (0.8 + 0.1 * mode) * (rpm / 60) ** 2)


def modes_result() -> xr.Dataset:
    """Return the node ``modes``."""
    points, triangles = skin()
    k, mode = np.meshgrid(np.arange(SECTORS // 2 + 1), np.arange(MODES), indexing="ij")
    angle, radius = np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1])
    lift = np.exp(1j * k[..., None] * angle) * np.cos(np.pi * mode[..., None] * (radius - 0.1) / 0.1)
    shape = np.zeros((*lift.shape, 3), dtype=complex)
    shape[..., 2] = lift
    hz = frequency(k, mode)
    reference = hz * (1 + 1e-4 * (mode + 1))
    reference[0, 0] = np.nan
    data = (
        facts()
        | waves(list(range(SECTORS // 2 + 1)))
        | {
            "frequency_hz": variable("wave mode", hz, "Hz"),
            "seconds": variable("wave", np.ones(len(hz)), "s"),
            "reference_hz": variable("wave mode", reference, "Hz"),
            "difference": variable("wave mode", hz / reference - 1),
            "shape": variable("wave mode skin_point xyz part", np.stack([shape.real, shape.imag], axis=-1)),
            "skin_point": variable("skin_point xyz", points, "m"),
            "skin_triangle": variable("face corner", triangles),
            "skin_cut": variable("face", np.zeros(len(triangles), dtype=int)),
        }
    )
    return node(data)


def campbell_result() -> xr.Dataset:
    """Return the node ``campbell``; the crossings come from the formula of the frequencies."""
    numbers, orders, rpm = [2, 3], [2, 3, 5, 6], np.linspace(0.0, 12000.0, 7)
    k, s, mode = np.meshgrid(numbers, rpm, np.arange(MODES), indexing="ij")
    rows = []
    for w, number in enumerate(numbers):
        for order in orders:
            if min(order % SECTORS, -order % SECTORS) != number:
                continue
            for m in range(MODES):
                # (order x)^2 = at rest^2 + slope x^2 with x = rpm / 60
                x = frequency(np.array(number), np.array(m), 0.0) / np.sqrt(order**2 - (0.8 + 0.1 * m))
                if x * 60 <= rpm[-1]:
                    rows.append((w, m, order, x * 60, x * order))
    columns = list(zip(*rows, strict=True))
    data = (
        facts(speed_rpm=0.0)
        | waves(numbers)
        | {
            "engine_orders": variable("order", orders),
            "speed_rpm": variable("speed", rpm, "rpm"),
            "frequency_hz": variable("wave speed mode", frequency(k, mode, s), "Hz"),
            "seconds": variable("wave", [1.0, 1.0], "s"),
            "crossing_wave": variable("crossing", columns[0]),
            "crossing_mode": variable("crossing", columns[1]),
            "crossing_engine_order": variable("crossing", columns[2]),
            "crossing_speed_rpm": variable("crossing", columns[3], "rpm"),
            "crossing_frequency_hz": variable("crossing", columns[4], "Hz"),
        }
    )
    return node(data)


def safe_result(margin: float = 0.05) -> xr.Dataset:
    """Return the node ``safe``."""
    k, mode = np.meshgrid(np.arange(SECTORS // 2 + 1), np.arange(MODES), indexing="ij")
    hz, rows = frequency(k, mode), []
    for order in range(1, 13):
        wave = min(order % SECTORS, -order % SECTORS)
        rows += [(wave, m, order, hz[wave, m], order * 100.0) for m in range(MODES)]
    columns = [np.array(c) for c in zip(*rows, strict=True)]
    off = columns[4] / columns[3] - 1
    data = (
        facts(margin_percent=100 * margin)
        | waves(list(range(SECTORS // 2 + 1)))
        | {
            "frequency_hz": variable("wave mode", hz, "Hz"),
            "pair_wave": variable("pair", columns[0]),
            "pair_mode": variable("pair", columns[1]),
            "pair_engine_order": variable("pair", columns[2]),
            "pair_frequency_hz": variable("pair", columns[3], "Hz"),
            "pair_excitation_hz": variable("pair", columns[4], "Hz"),
            "pair_margin": variable("pair", off),
            "pair_near": variable("pair", (np.abs(off) <= margin).astype(int)),
        }
    )
    return node(data)
