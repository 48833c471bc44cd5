"""J5: matrices of one's own from .npz or Matrix Market, contacts named by dof, against the same model from masses and springs."""

import runpy
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from small_v2 import EXAMPLES, changed
from test_cli import done, refused

from stickslip.api.result import Result
from stickslip.errors import InputError
from stickslip.model.modes import lowest_modes
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("peak_alone")

EXAMPLE = EXAMPLES / "own_matrices"
FEW = {
    "forced_response.frequencies_hz": "[7.0, 8.0, 9.0, 9.5, 10.0, 10.5, 11.0, 12.0]",
    "forced_response.peak_points": "0",
    "forced_response.stability": '"off"',
}
FEW["harmonics.selection"] = '"always_high"'  # steps of a branch follow rounding
FEW["part.chain.reduction.method"] = '"none"'  # else its modes are coordinates, and round off otherwise
TABLE = "node,component,x,y,z\n" + "".join(f"{i + 1},x,0,0,0\n" for i in range(20))
SPRINGS = ", ".join(f'["{f"m{i}" if i else "ground"}", "m{i + 1}", 2e5]' for i in range(20))
LUMPED = f'shape = "lumped"\nmasses_kg = {[0.5] * 20}\nsprings_n_per_m = [{SPRINGS}]\n'
OF_THE_FILE = 'file = "chain.npz"', 'units = "SI"'


def write(folder: Path, part: str, dof: str) -> Path:
    """Write the study of the example about another part, whose dofs have other names."""
    folder.mkdir(parents=True, exist_ok=True)
    text = (EXAMPLE / "study.toml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith(OF_THE_FILE)]
    text = "\n".join(lines).replace("[part.chain]", f"[part.chain]\n{part}")
    text = text.replace("frequency_hz = [7.0, 12.0]\npoints = 30\n", "")
    for i in range(20, 0, -1):
        text = text.replace(f"chain.dof{i}", f"chain.{dof.format(i)}")
    path = folder / "study.toml"
    path.write_text(changed(text, FEW | {"output.peak": '""'}))
    return path


def response(path: Path) -> np.ndarray:
    done("run", str(path), "--no-report")
    data = Result.from_file(path.parent / "results").data["forced_response"]
    return np.column_stack([data["frequency_hz"], data["amplitude"]])


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory):
    path = write(tmp_path_factory.mktemp("lumped"), LUMPED, "m{}")
    return response(path)


def matrices() -> tuple[np.ndarray, np.ndarray]:
    with np.load(EXAMPLE / "chain.npz") as arrays:
        return arrays["mass"], arrays["stiffness"]


def test_the_script_of_the_example_writes_its_matrices(tmp_path: Path) -> None:
    shutil.copy(EXAMPLE / "make_matrices.py", tmp_path)
    runpy.run_path(str(tmp_path / "make_matrices.py"))
    assert (tmp_path / "chain.npz").read_bytes() != b""
    with np.load(tmp_path / "chain.npz") as arrays:
        for name, kept in zip(("mass", "stiffness"), matrices(), strict=True):
            assert np.array_equal(arrays[name], kept)


@pytest.mark.parametrize("kind", ["npz", "mtx", "sparse npz with a table"])
def test_own_matrices_give_the_response_of_the_same_masses_and_springs(tmp_path, chain, kind):
    mass, stiffness = matrices()
    part, dof = '\nunits = "SI"', "dof{}"
    if kind == "npz":
        shutil.copy(EXAMPLE / "chain.npz", tmp_path)
        part = 'file = "chain.npz"' + part
    elif kind == "mtx":
        for name, matrix in (("K", stiffness), ("M", mass)):
            scipy.io.mmwrite(tmp_path / f"{name}.mtx", scipy.sparse.coo_array(matrix))
        part = 'file = "K.mtx"\nmass = "M.mtx"' + part
    else:
        for name, matrix in (("K", stiffness), ("M", mass)):
            scipy.sparse.save_npz(tmp_path / f"{name}.npz", scipy.sparse.csr_array(matrix))
        (tmp_path / "dofs.csv").write_text(TABLE)
        part, dof = 'file = "K.npz"\nmass = "M.npz"\nnodes = "dofs.csv"' + part, "node{}.x"
    found = response(write(tmp_path, part, dof))
    assert found.shape == chain.shape
    assert np.all(np.abs(found - chain) < 1e-10 * np.max(np.abs(chain), axis=0))


def test_damping_in_the_file_is_kept_and_a_table_of_the_part_replaces_it(tmp_path: Path) -> None:
    mass, stiffness = matrices()
    np.savez(tmp_path / "chain.npz", mass=mass, stiffness=stiffness, damping=1e-4 * stiffness)
    shutil.copy(EXAMPLE / "study.toml", tmp_path)
    part = read_study(tmp_path / "study.toml").model().parts["chain"]
    assert part.damping is None
    assert np.array_equal(part.structure.damping, 1e-4 * stiffness)
    own = "[part.chain.damping]\nmodal_ratio = 0.01\n[contact.brake]"
    text = (EXAMPLE / "study.toml").read_text().replace("[contact.brake]", own)
    (tmp_path / "study.toml").write_text(text)
    part = read_study(tmp_path / "study.toml").model().parts["chain"]
    assert part.damping is not None
    assert part.damping.modal == 0.01


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"load.shaker.on": '"chain.dof21"'}, "there is no surface or set 'chain.dof21'"),
        ({"part.chain.file": '"none.npz"'}, "there is no file"),
        ({"part.chain.mass": '"M.mtx"'}, "M.mtx: is of 3 x 3, the model has 20 dofs"),
        ({"contact.stop.between": '["chain.dof0", "ground"]'}, "has 20 dofs, chain.dof1 to chain.dof20."),
        ({"contact.joint.between": '["chain.dof12", "chain.DOF12"]'}, "pairs 'chain.dof12' with itself"),
        ({"contact.joint.pairing": '"segment_to_segment"'}, "contact.joint.pairing: is given, and 'chain.dof"),
        ({"contact.joint.normal": "[0.0, 0.0, 1.0]"}, "contact.joint.normal: is given, and 'chain.dof"),
        ({"output.peak": '"tip.dof20"'}, "no output 'tip.dof20'. Did you mean 'end.dof20'?"),
        ({"load.shaker.direction": '"y"'}, "load.shaker.direction: is given, but 'chain.dof20' is a single dof"),
        ({"modes.number": "21"}, "modes.number: is 21, and the model has 20 dofs with mass. Give at most 20."),
        ({"modes.nodal_diameters": "[1]"}, "modes.nodal_diameters: are of a wheel, and no part is a sector of one"),
        ({"contact.brake.between": '["ground", "ground"]'}, "are both the ground. Name a place of a part first."),
        ({"limits.memory_gb": "0.01"}, "the parts, some 2 nodes"),
        ({"damping.ratio": "1.0"}, "from 0 to below 1 (0.01 is 1 %)"),
        ({"reduction.fixed_interface_modes": "0"}, "It means: number of modes that craig_bampton keeps"),
        ({"output.peak": '"end.x"'}, "no output 'end.x'. Known: end.dof20, middle.dof10."),
    ],
)
def test_what_does_not_fit_is_refused_by_name(tmp_path: Path, changes, message) -> None:
    for name in ("chain.npz", "study.toml"):
        shutil.copy(EXAMPLE / name, tmp_path)
    scipy.io.mmwrite(tmp_path / "M.mtx", scipy.sparse.eye_array(3).tocoo())
    path = tmp_path / "study.toml"
    path.write_text(changed(path.read_text(), changes))
    assert message in refused("check", str(path))


def copied(folder: Path, changes: dict[str, str], **arrays: np.ndarray) -> Path:
    """Write the example's study with changes, and its matrices with others in their place."""
    given = dict(zip(("mass", "stiffness"), matrices(), strict=True)) | arrays
    np.savez(folder / "chain.npz", **given)
    path = folder / "study.toml"
    path.write_text(changed((EXAMPLE / "study.toml").read_text(), changes))
    return path


def test_matrices_without_a_table_are_of_translations_in_any_units(tmp_path: Path) -> None:
    """In millimetres, tonnes and seconds a spring of 2e5 N/m has 200 N/mm, and a mass of 0.5 kg 5e-4 t."""
    mass, stiffness = matrices()
    small = {"mass": mass / 1e3, "stiffness": stiffness / 1e3, "damping": 1e-7 * stiffness}
    path = copied(tmp_path, {"part.chain.units": '"mm-t-s"'}, **small)
    found = read_study(path).model().parts["chain"].structure
    assert np.allclose(found.mass, mass, rtol=1e-12)
    assert np.allclose(found.stiffness, stiffness, rtol=1e-12)
    assert np.allclose(found.damping, 1e-4 * stiffness, rtol=1e-12)


def test_names_of_dofs_need_no_capitals(tmp_path: Path) -> None:
    path = copied(tmp_path, {"contact.brake.between": '["chain.DOF8", "ground"]'})
    assert read_study(path).model().pairs.nodes[0, 0] == 7


def test_dofs_of_a_table_are_named_where_a_number_is_given(tmp_path: Path) -> None:
    (tmp_path / "dofs.csv").write_text(TABLE)
    path = copied(tmp_path, {"part.chain.nodes": '"dofs.csv"'})
    assert "called by node and direction: 'chain.node1.x'" in refused("check", str(path))


def test_arrays_of_other_names_are_told(tmp_path: Path) -> None:
    path = copied(tmp_path, {})
    mass, stiffness = matrices()
    np.savez(tmp_path / "chain.npz", K=stiffness, M=mass)
    said = "holds the arrays K, M, and no stiffness. Its arrays must be called mass, stiffness"
    assert said in refused("check", str(path))
    assert said in refused("inspect", str(tmp_path / "chain.npz"))


M, K = matrices()


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"stiffness": K - 3e5 * np.diag(np.eye(20)[3])}, "stiffness: is not positive: a motion, dof4 the most"),
        ({"mass": M - np.diag(np.eye(20)[3])}, "mass: is negative, -0.5, at dof4"),
    ],
)
def test_matrices_of_the_wrong_sign_are_refused_by_file_and_dof(tmp_path, arrays, message) -> None:
    said = refused("check", str(copied(tmp_path, {}, **arrays)))
    assert f"chain.npz: {message}" in said


def test_modes_of_a_negative_mass_are_looked_for_without_a_root_of_it() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputError, match="has a negative one"):
            lowest_modes(K, M - np.diag(np.eye(20)[3]), 20, None)


def test_a_chain_on_the_ground_is_held_by_more_than_sliders(tmp_path: Path) -> None:
    assert "sliders alone" not in done("check", str(copied(tmp_path, {})))


def test_a_matrix_of_another_size_is_named(tmp_path: Path) -> None:
    said = refused("check", str(copied(tmp_path, {}, mass=M[:5, :5])))
    assert "chain.npz: mass: is of 5 x 5, the model has 20 dofs" in said


def test_rigid_motions_are_counted_and_elements_that_are_not_there_are_not(tmp_path: Path) -> None:
    free = K.copy()
    free[0, 0] = -K[0, 1]
    said = done("check", str(copied(tmp_path, {}, stiffness=free)))
    assert "natural frequencies, contacts open: 1 of rigid motions, " in said
    assert "elements" not in said
    assert "part.chain: sliders alone hold it" in said.replace("\n", " ")


def test_negative_damping_is_warned_of(tmp_path: Path) -> None:
    model = read_study(copied(tmp_path, {}, damping=np.diag(np.arange(20) - 3.0))).model()
    assert "damping is negative, -3 N s/m in a motion of dof1" in model.warnings[0]
    model = read_study(copied(tmp_path, {}, damping=np.diag(np.arange(20.0)))).model()
    assert model.warnings == ()


def test_a_lossy_stiffness_is_told_from_one_that_lacks_symmetry(tmp_path: Path) -> None:
    said = refused("check", str(copied(tmp_path, {}, stiffness=(1 + 0.01j) * matrices()[1])))
    assert "is complex and symmetric" in said
    assert "loss_factor" in said


def test_speeds_of_matrices_are_refused_together(tmp_path: Path) -> None:
    for name in ("chain.npz", "study.toml"):
        shutil.copy(EXAMPLE / name, tmp_path)
    path = tmp_path / "study.toml"
    more = "[rotation]\nspeed_rpm = 100.0\n[campbell]\nspeeds_rpm = [0.0, 9.0]\nengine_orders = [2]\n"
    path.write_text(path.read_text() + more)
    said = refused("check", str(path))
    assert "campbell: needs a part that a speed changes" in said
    assert "rotation.speed_rpm: is 100, but no part is a mesh" in said
