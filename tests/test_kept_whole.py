"""Parts that a study keeps whole, of which too many dofs touch no contact: what runs, and what is refused before anything long begins."""

import numpy as np
import pytest
from test_root_joint import COARSE, CONTACT, FINE, blocks
from typer.testing import CliRunner

from stickslip.analyses.forced_response.estimate import estimate
from stickslip.cli import app
from stickslip.response.forced.sweep import Sweep
from stickslip.study.models.study import read_study
from stickslip.study.store.netcdf import read_tree

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

MODEL = (
    CONTACT.format("node_to_segment").replace("interference_m = 1e-6\n", "")
    + """
[damping]
ratio = 0.005
between_hz = [2000.0, 60000.0]
[load.press]
on = "upper.top"
force_n = 400.0
direction = "-z"
harmonic = 0
[load.shaker]
on = "upper.top"
force_n = 1.0
direction = "x"
[output]
points = { shaken = "upper.top" }
peak = "shaken.x"
"""
)
FORCED = """
[forced_response]
frequencies_hz = [4000.0, 4600.0]
peak_points = 0
[harmonics]
high = 2
selection = "always_high"
"""
OTHERS = {
    "resonance": 'frequency_hz = [4600.0, 5000.0]\nparameter = "load.shaker.force_n"\nvalues = [0.4, 0.5]',
    "all_motions": "frequency_hz = [4600.0, 5000.0]",
    "modal_synthesis": "",
    "nonlinear_mode": "",
    "residual_tractions": "frequency_hz = [4600.0, 5000.0]",
    "quasi_periodic": "frequency_hz = [4600.0, 5000.0]\nsecond_hz = 3000.0",
    "limit_cycle": "modes = [1]",
    "run_up": "speeds_rpm = [280000.0, 290000.0]\nengine_orders = [1]",
}


@pytest.fixture(autouse=True)
def _few(monkeypatch):
    monkeypatch.setattr("stickslip.assembly.sides.unreduced.LARGEST_INTERIOR", 20)


def study(folder, more, whole='[reduction]\nmethod = "none"\n'):
    folder.mkdir(exist_ok=True)
    return blocks(folder, COARSE, FINE, whole + MODEL + more, ())


def said(*arguments):
    found = CliRunner().invoke(app, [str(a) for a in arguments])
    return found.exit_code, " ".join(found.output.split())


def test_the_response_of_parts_kept_whole_from_the_command_line(tmp_path, monkeypatch):
    path = study(tmp_path / "whole", FORCED)
    code, told = said("check", path)
    assert code == 0
    assert "all 198 dofs are unknown in each harmonic" in told
    assert "990 unknowns" in told
    assert "stability: not examined, a reduced model is needed" in told
    code, told = said("run", path, "--no-report")
    assert code == 0, told
    code, told = said("export", path.parent / "results", "--steps", "2")
    assert code == 0, told
    assert list((path.parent / "results").rglob("*.vtu"))
    monkeypatch.setattr("stickslip.assembly.sides.unreduced.LARGEST_INTERIOR", 5000)
    other = study(tmp_path / "condensed", FORCED)
    code, told = said("run", other, "--no-report")
    assert code == 0, told
    one, two = (read_tree(p.parent / "results" / "result.nc")["forced_response"] for p in (path, other))
    np.testing.assert_allclose(one["amplitude"], two["amplitude"], rtol=1e-6)


@pytest.mark.parametrize("name", OTHERS)
def test_other_analyses_refuse_them_and_name_the_key(tmp_path, name):
    code, told = said("check", study(tmp_path, f"[{name}]\n{OTHERS[name]}\n"))
    assert code == 2, told
    assert f'{name}: needs a reduced model: reduction.method = "none" keeps parts whole' in told
    assert 'Reduce the parts (method = "craig_bampton")' in told


def test_run_refuses_what_check_refuses(tmp_path):
    path = study(tmp_path, FORCED)
    code, told = said("run", path, "--verify")
    assert code == 2
    assert "--verify: needs a reduced model" in told
    path.write_text(path.read_text().replace("elastic_coulomb", "rigid_coulomb"), encoding="utf-8")
    text = [line for line in path.read_text().splitlines() if "stiffness" not in line]
    path.write_text("\n".join(text).replace('per = "area"\n', ""), encoding="utf-8")
    code, told = said("run", path)
    assert code == 2
    assert "contact.joint.law: is rigid_coulomb, which needs a reduced model" in told


@pytest.mark.parametrize(
    "more",
    [
        "[modes]\nshapes = false\n",
        "[campbell]\nspeeds_rpm = [1000.0, 10000.0]\npoints = 2\nengine_orders = [1]\n[rotation]\nspeed_rpm = 5000\ncentrifugal = false\n",
    ],
)
def test_natural_frequencies_need_no_reduction(tmp_path, more):
    code, told = said("run", study(tmp_path, more), "--no-report")
    assert code == 0, told


def test_hundreds_of_contacts_are_not_refused_for_an_array_that_is_never_formed(tmp_path):
    grid = (np.linspace(0.0, 1.0, 18).tolist(),) * 2
    tmp_path.mkdir(exist_ok=True)
    path = blocks(tmp_path, grid, grid, MODEL + FORCED, ())
    sweep = Sweep(omega_range=(1.0, 2.0), high=5, selection="always_high", frequencies=30)
    cost = estimate(read_study(path).model(), sweep)
    array = 8 * cost.unknowns**2 / 1e9
    matrices = 8 * (cost.unknowns / 11) ** 2 / 1e9
    assert cost.unknowns == 11 * 3 * 18**2
    assert 10 * matrices < cost.memory_gb < 2.0 * array
