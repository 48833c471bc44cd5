"""A sector of finite elements from a study file, through the command line, against all sectors as one structure without symmetry.

Shrouds of neighbours, and a ring around them, held at its outside, against which they are pressed; centrifugal load, Coriolis
forces, a static gas load and two engine orders in one solve.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from test_assembly_wheel import SECTORS, SPEED, STEEL
from test_cli import done
from test_parts_between_sectors import HALF, H, answered, around, brick

import stickslip.harmonic.balance as balance_module
from stickslip.assembly.assembling import assemble
from stickslip.model.axis import Axis
from stickslip.model.deck import write_deck
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.response.parameter import Discretisation
from stickslip.response.resonances.tracking import track_peak
from stickslip.solve.krylov import Krylov
from stickslip.solve.newton_method import Newton
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

Vector = Sequence[float]
AXIS, PITCH = Axis(), 2 * math.pi / SECTORS
GAS, LEAN, STEADY = (0.2, 1.0, 0.3), (0.0, 1.0, 1.0), 300.0
HERTZ = 1000.0  # of engine order 1
ORDERS = {2: 3000.0, 3: 1500.0}  # engine order -> N
# contact -> between, at rest, normal; "next." is of the next sector
CONTACTS = {
    "shroud": (
        "blade.touch_high",
        "next.blade.touch_low",
        "interference_m = 2e-5",
        (-math.sin(HALF), math.cos(HALF), 0.0),
    ),
    "groove": ("ring.inside", "blade.outside", "interference_m = 2e-5", (-1.0, 0.0, 0.0)),
}
LAW = """pairing = "node_to_segment"
law = "elastic_coulomb"
per = "point"
normal_stiffness_n_per_m = 8e6
tangential_stiffness_n_per_m = 6e6
axial_stiffness_n_per_m = 6e6
friction_coefficient = 0.2
"""
REST = f"""
[damping]
ratio = 0.004
between_hz = [500.0, 3000.0]
[rotation]
speed_rpm = {SPEED * 30 / math.pi!r}
coriolis = true
[reduction]
method = "none"
[forced_response]
frequencies_hz = [{HERTZ}]
stability = "off"
[harmonics]
low = 3
high = 3
selection = "always_low"
samples = 128
"""


def blade() -> SolidMesh:
    """A piece of a ring clamped below, a blade of one brick, a shroud that fills the pitch."""
    half = HALF * np.array([-1.0, -0.3, 0.35, 1.0])
    mesh = brick((0.10, 0.13, 0.18, 0.20), tuple(half), (-0.02, 0.02))
    number = np.arange(32).reshape(4, 4, 2)
    sets = {
        "root": number[0],
        "cyclic_low": number[:2, 0],
        "cyclic_high": number[:2, 3],
        "tip": number[3, 1:3],
        "touch_low": number[2:, 0],
        "touch_high": number[3, 3],
        "outside": number[3],
    }
    layers = np.array([0, 0, 0, 1, 1, 1, 2, 2, 2]), np.array([0, 1, 2] * 3)
    cells = mesh.cells[(layers[0] != 1) | (layers[1] == 1)]
    return SolidMesh(mesh.points, cells, {name: own.ravel() for name, own in sets.items()})


def ring() -> SolidMesh:
    """A piece of a ring around the blades, held at its outside; two nodes of it meet the shroud below."""
    mesh = brick((0.20, 0.206), (-HALF, -0.3 * HALF, 0.35 * HALF, HALF), (-0.018, 0.018))
    inside = mesh.node_sets["inside"].reshape(4, 2)[1]
    return replace(mesh, node_sets=mesh.node_sets | {"inside": inside.ravel()})


def vector(v: Vector) -> str:
    return "[" + ", ".join(repr(float(x)) for x in v) + "]"


def contact(name: str, ends: tuple[str, str], rest: str, normal: Vector, turn: float = 0.0) -> str:
    t, n = ([*(AXIS.rotation(turn) @ v)] for v in ((0.3, 0.2, 1.0), normal))
    return f'[contact.{name}]\nbetween = ["{ends[0]}", "{ends[1]}"]\ntangent = {vector(t)}\nnormal = {vector(n)}\n{rest}\n{LAW}'


def load(name: str, on: str, force: float, direction: Vector, more: str) -> str:
    return f'[load.{name}]\non = "blade.{on}"\nforce_n = {force}\ndirection = {vector(direction)}\n{more}\n'


def study(met: str, driven: str, tip: np.ndarray) -> str:
    parts = "".join(f'[part.{name}]\nfile = "{name}.inp"\nunits = "SI"\n' for name in ("blade", "ring"))
    place = f"[output]\npoints = {{ tip = {{ on = 'blade', near_m = {vector(tip)} }} }}\n"
    return f"schema_version = 2\n{parts}{met}{driven}{REST}{place}"


def write_one_sector(folder: Path) -> Path:
    folder.mkdir()
    write_deck(blade(), STEEL, folder / "blade.inp", sectors=SECTORS)
    write_deck(ring(), STEEL, folder / "ring.inp", sectors=SECTORS, clamped=("outside",))
    met = "".join(contact(name, (a, b), *more) for name, (a, b, *more) in CONTACTS.items())
    driven = "".join(load(f"order{m}", "tip", f, GAS, f"engine_order = {m}") for m, f in ORDERS.items())
    driven += load("steady", "tip", STEADY, LEAN, "harmonic = 0")
    text = study(met, driven, blade().points[blade().node_sets["tip"][0]])
    (folder / "study.toml").write_text(text)
    return folder


def write_all_sectors(folder: Path) -> Path:
    """One mesh of all blades and one of the ring, which know of no sectors; contacts and loads of each sector by themselves."""
    folder.mkdir()
    sets = "root", "touch_low", "touch_high", "outside", "tip"
    held = [f"root{s}" for s in range(SECTORS)]
    write_deck(around(blade(), sets), STEEL, folder / "blade.inp", clamped=held)
    held = [f"outside{s}" for s in range(SECTORS)]
    write_deck(around(ring(), ("inside", "outside")), STEEL, folder / "ring.inp", clamped=held)
    met = driven = ""
    for s in range(SECTORS):
        turn = AXIS.rotation(PITCH * s)
        for name, (a, b, rest, n) in CONTACTS.items():
            there = b.removeprefix("next.") + str((s + b.startswith("next.")) % SECTORS)
            met += contact(f"{name}{s}", (f"{a}{s}", there), rest, n, PITCH * s)
        for m, force in ORDERS.items():
            phase = f"harmonic = {m}\nphase_deg = {(360 * m * s / SECTORS) % 360}"
            driven += load(f"order{m}_{s}", f"tip{s}", force, turn @ GAS, phase)
        driven += load(f"steady{s}", f"tip{s}", STEADY, turn @ LEAN, "harmonic = 0")
    text = study(met, driven, blade().points[blade().node_sets["tip"][0]])
    (folder / "study.toml").write_text(text)
    return folder


def test_one_sector_from_a_file_answers_as_all(tmp_path: Path) -> None:
    done("run", str(write_one_sector(tmp_path / "one") / "study.toml"), "--no-report")
    one = xr.open_dataset(tmp_path / "one" / "results" / "result.nc", group="forced_response")
    assert one["status"].values.tolist() == [0]
    shroud, groove = np.split(one["peak_state"].isel(case=0).values, 2)
    for point in shroud:
        assert set(np.unique(point)) == {0, 1, 2}  # sticks, slips, lifts off and comes back
    assert all((point == 1).any() and (point < 2).all() for point in groove)  # slips, pressed
    preload = one["static_force"].isel(case=0).sel(direction="n").values
    assert np.all(preload[2:] < -100.0)
    _, every, _ = answered(read_study(write_all_sectors(tmp_path / "every") / "study.toml").model(), HERTZ)
    pair = one["output_displacement"].isel(point=0).values
    apart = pair[..., 0] + 1j * pair[..., 1] - every.outputs
    assert np.abs(apart).max() < 1e-8 * np.abs(every.outputs).max()


def test_its_peak_is_tracked_by_products_as_by_arrays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """More friction, two engine orders, Coriolis forces; the slope along the peaks is that of their difference."""
    found = assemble(read_study(write_one_sector(tmp_path / "one") / "study.toml").model(), H)
    values, span = (0.2, 0.202), (2 * math.pi * 930, 2 * math.pi * 960)
    how = Discretisation(order=H, samples=128)
    arrays = list(track_peak(found.system, found.load, "mu", values, span, output=1, discretisation=how))
    assert all(point.converged and point.is_maximum for point in arrays)
    krylov = Krylov()
    monkeypatch.setattr(balance_module, "products_pay", lambda _: True)
    how = replace(how, newton=Newton(linear=krylov))
    products = list(track_peak(found.system, found.load, "mu", values, span, output=1, discretisation=how))
    assert krylov.counts.products > 0
    for one, other in zip(arrays, products, strict=True):
        assert other.amplitude == pytest.approx(one.amplitude, rel=1e-8)
        assert other.omega == pytest.approx(one.omega, rel=1e-8)
    slope = (arrays[1].amplitude - arrays[0].amplitude) / (values[1] - values[0])
    assert slope == pytest.approx((arrays[0].slope + arrays[1].slope) / 2, rel=1e-4)
