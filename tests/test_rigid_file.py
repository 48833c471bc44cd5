"""Rigid friction from a study file: the limit of stiff springs, and what it cannot be asked."""

import numpy as np
import pytest
from test_contacts_file import CHAIN
from typer.testing import CliRunner

from stickslip.assembly.assembling import assemble
from stickslip.cli import app
from stickslip.study.models.study import read_study
from stickslip.study.store.netcdf import read_tree
from stickslip.study.verdict import stored

RIGID = 'law = "rigid_coulomb"\nfriction_coefficient = 0.5\npreload_n = 4.0\n'
MORE = {
    'selection = "always_low"': 'selection = "always_high"',
    "high = 3": "high = 7",
    "samples = 64": "samples = 128",
    "[15.0, 20.0, 25.0]": "[15.0, 19.0]",
}
THREE = {
    "[1.0, 1.0]": "[1.0, 1.0, 1.0]",
    "[1, 2, 4e4]]": "[1, 2, 4e4], [2, 3, 4e4]]",
    'on = "chain.m1"': 'on = "chain.m3"',
    'first = "chain.m1"': 'first = "chain.m3"',
    '"chain.m2", "ground"': '"chain.m1", "chain.m2"',
}


def written(folder, contact=RIGID, changes=None, more=""):
    text = CHAIN
    for old, new in (MORE | dict(changes or {})).items():
        assert old in text
        text = text.replace(old, new)
    head, _, joint = text.partition("[contact.joint]")
    path = folder / "study.toml"
    path.write_text(f"{head}[contact.joint]{joint}{contact}{more}", encoding="utf-8")
    return path


def command(*words):
    found = CliRunner().invoke(app, [str(word) for word in words])
    return found.exit_code, " ".join(found.output.split())


def motion(folder, *words, **changes):
    path = written(folder, **changes)
    code, told = command("run", path, *words)
    assert code == 0, told
    data = read_tree(folder / "results" / "result.nc")["forced_response"]
    parts = data["output_displacement"].values[:, 1, 0]
    return parts[:, 0] + 1j * parts[:, 1], data


@pytest.mark.parametrize("chain", [{}, THREE], ids=["ground", "between"])
def test_rigid_friction_is_the_limit_of_stiff_springs(chain, tmp_path):
    """The error of springs falls like k^(-1/2) (docs/theory/dlft.md), down to what seven harmonics leave out."""
    (tmp_path / "rigid").mkdir()
    rigid, data = motion(tmp_path / "rigid", changes=chain)
    # no error is predicted where a contact is rigid, and the peak stands at the end of the sweep
    unexamined, end, *_ = stored(data.attrs)
    assert (unexamined.level, end.level) == ("doubtful", "doubtful")
    assert "no error is predicted for rigid contacts" in unexamined.remedy
    assert "at the end of the sweep" in end.why
    assert str(data["contact_law"].values[0]) == "rigid_coulomb"
    force = data["peak_force"].values[0, 0, 0]
    assert np.abs(force).max() == pytest.approx(0.5 * 4.0)
    assert "rigid_coulomb" in (tmp_path / "rigid" / "results" / "report.html").read_text("utf-8")
    errors = []
    for k in (1e5, 1e7):
        folder = tmp_path / f"{k:g}"
        folder.mkdir()
        springs = f'law = "jenkins"\nslip_limit_n = 2.0\ntangential_stiffness_n_per_m = {k}\n'
        soft = motion(folder, "--no-report", contact=springs, changes=chain)[0]
        errors.append(np.abs(soft - rigid).max() / np.abs(rigid).max())
    assert errors[1] < 0.25 * errors[0]
    assert errors[1] < 0.05


def test_linear_analyses_take_rigid_contacts_as_stuck(tmp_path):
    path = written(tmp_path, more="[modes]\nnumber = 1\ncontacts = 'stuck'\n")
    code, told = command("check", path)
    assert code == 0, told
    code, told = command("run", path, "--only", "modes")
    assert code == 0, told
    data = read_tree(tmp_path / "results" / "result.nc")["modes"]
    held = np.sqrt(8e4) / (2 * np.pi)  # the second mass does not move
    assert float(data["frequency_hz"].values[0, 0, 0]) == pytest.approx(held, rel=1e-5)


def test_a_static_load_that_friction_holds_moves_nothing(tmp_path):
    pull = '[load.pull]\non = "chain.m2"\nforce_n = 1.5\nharmonic = 0\n'
    found = assemble(read_study(written(tmp_path, more=pull)).model(), 1)
    assert found.static_force[0, 0] == pytest.approx(-1.5, rel=1e-4)
    assert abs(found.static_gap[0, 0]) < 1e-9


REFUSED = [
    (
        {'selection = "always_low"': 'selection = "jacobian_alert"'},
        RIGID,
        [],
        "harmonics.selection: is 'jacobian_alert', which predicts",
    ),
    ({"high = 3": "high = [1, 2, 3, 5]"}, RIGID, [], "harmonics.high: leaves harmonics out"),
    ({}, RIGID, ["--verify"], "contact.joint.law: --verify integrates in time, and rigid_coulomb has no stiffness"),
    ({}, RIGID, ["--verify-harmonics"], "--verify-harmonics predicts from contact forces"),
    (
        {},
        RIGID.replace("preload_n = 4.0\n", ""),
        [],
        "contact.joint.preload_n: is missing: the law rigid_coulomb takes its pressure",
    ),
    (
        THREE | {'first = "chain.m1"': 'first = "chain.m2"'},
        RIGID,
        [],
        "output.points: names a node that a contact of rigid_coulomb touches",
    ),
]


@pytest.mark.parametrize(("changes", "contact", "words", "said"), REFUSED)
def test_what_rigid_contacts_cannot_do_is_refused_by_name(changes, contact, words, said, tmp_path):
    code, told = command("run", written(tmp_path, contact, changes), *words)
    assert code == 2
    assert said in told
