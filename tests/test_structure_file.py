"""Structures in files: everything comes back, nothing is executed, damage is named."""

import io
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip import InputError
from stickslip.model import chain, load_structure, save_structure
from stickslip.model.structure import Dofs, Structure


def travelling() -> Structure:
    """A small complex sparse structure with a sparse basis and odd names."""
    rng = np.random.default_rng(3)
    A = rng.standard_normal((5, 5)) + 1j * rng.standard_normal((5, 5))
    stiffness = scipy.sparse.csr_array(A @ A.conj().T)
    dofs = Dofs(
        np.array([7, 7, 9, -1, -1]),
        ("x", "y", "z", "mode", "rz"),
        np.array([[0.1, 0.2, 0.3]] * 3 + [[np.nan] * 3] * 2),
        ("blade", "blade", "", "", "scheibe ä"),
    )
    sets = {"tip": np.array([2, 0]), "empty": np.array([], dtype=int), "Nabe ø": np.array([4])}
    basis = scipy.sparse.csr_array(rng.standard_normal((8, 5)) * (1 + 1j))
    return Structure(
        scipy.sparse.eye_array(5, format="csr"), scipy.sparse.csr_array((5, 5)), stiffness, dofs, sets, basis
    )


def same(a: Structure, b: Structure) -> None:
    for name in ("mass", "damping", "stiffness", "basis"):
        first, second = getattr(a, name), getattr(b, name)
        assert (first is None) == (second is None)
        if first is None:
            continue
        assert scipy.sparse.issparse(first) == scipy.sparse.issparse(second)
        assert first.dtype == second.dtype
        dense = [m.toarray() if scipy.sparse.issparse(m) else m for m in (first, second)]
        np.testing.assert_array_equal(*dense)
    assert a.dofs.labels == b.dofs.labels
    np.testing.assert_array_equal(a.dofs.position, b.dofs.position)
    assert list(a.sets) == list(b.sets)
    for name, members in a.sets.items():
        np.testing.assert_array_equal(members, b.sets[name])


@pytest.mark.parametrize("structure", [travelling(), chain(4, 2.0, 1e3, 1e-4)])
def test_everything_comes_back(tmp_path, structure):
    save_structure(structure, tmp_path / "s.npz")
    same(structure, load_structure(tmp_path / "s.npz"))
    assert [p.name for p in tmp_path.iterdir()] == ["s.npz"]  # no temporary file stays


def test_numpy_opens_it_without_pickle(tmp_path):
    save_structure(travelling(), tmp_path / "s.npz")
    with np.load(tmp_path / "s.npz", allow_pickle=False) as arrays:
        assert int(arrays["version"]) == 1
        assert list(arrays["mass.shape"]) == [5, 5]


def test_sets_that_are_masks_are_refused(tmp_path):
    masked = replace(chain(3, 1.0, 1.0), sets={"tip": np.array([True, False, False])})
    with pytest.raises(InputError, match=r"set 'tip'.*bool"):
        save_structure(masked, tmp_path / "s.npz")


def test_other_suffixes_and_missing_files(tmp_path):
    with pytest.raises(InputError, match=r"\.npz"):
        save_structure(chain(3, 1.0, 1.0), tmp_path / "s.mat")
    with pytest.raises(InputError, match="no such file"):
        load_structure(tmp_path / "none.npz")
    with pytest.raises(InputError, match="cannot be"):
        load_structure(tmp_path)


def test_foreign_npz_is_named(tmp_path):
    np.savez(tmp_path / "f.npz", a=np.zeros(3))
    with pytest.raises(InputError, match="not of a structure"):
        load_structure(tmp_path / "f.npz")


def rewritten(path: Path, **changes: object) -> Path:
    with np.load(path) as arrays:
        content = dict(arrays)
    for name, value in changes.items():
        if value is None:
            del content[name.replace("__", ".")]
        else:
            content[name.replace("__", ".")] = value
    np.savez(path, **content)
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": np.array(2)}, "version 2"),
        ({"mass__data": None}, "lacks the array 'mass.data'"),
        ({"mass__shape": np.array([4, 5])}, "do not fit"),
        ({"mass__indices": np.array([0, 1, 2, 3, 99])}, "do not fit"),
        ({"mass__indices": np.array([0.0, 1, 2, 3, 4])}, "no integers"),
        ({"set__0": np.array([5])}, "outside 0 .. 4"),
        ({"set__0": np.array([0.5])}, "do not fit"),
        ({"dofs__component": np.array(["x"])}, "do not fit"),
        ({"basis__shape": np.array([8, 6])}, "basis of shape"),
    ],
)
def test_parts_that_do_not_fit(tmp_path, changes, message):
    save_structure(travelling(), tmp_path / "s.npz")
    with pytest.raises(InputError, match=message):
        load_structure(rewritten(tmp_path / "s.npz", **changes))


class Bomb:
    """Runs code when a pickle of it is loaded."""

    def __reduce__(self):
        return (pytest.fail, ("the file was executed",))


def test_python_objects_are_never_loaded(tmp_path):
    path = tmp_path / "s.npz"
    save_structure(chain(3, 1.0, 1.0), path)
    objects = np.empty(1, dtype=object)
    objects[0] = Bomb()
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, objects, allow_pickle=True)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("extra.npy", buffer.getvalue())
    with pytest.raises(InputError, match="Python objects are never loaded"):
        load_structure(path)


def test_a_header_cannot_ask_for_more_than_the_file_has(tmp_path):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)})
    with zipfile.ZipFile(tmp_path / "s.npz", "w") as archive:
        archive.writestr("mass.npy", header.getvalue())
    with pytest.raises(InputError, match="8000000000000000 bytes"):
        load_structure(tmp_path / "s.npz")


@settings(max_examples=150)
@given(data=st.data())
def test_damaged_files_are_named_or_read_right(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("damage")
    path, original = folder / "s.npz", travelling()
    save_structure(original, path)
    content = bytearray(path.read_bytes())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] ^= data.draw(st.integers(1, 255))
    path.write_bytes(bytes(content))
    try:
        read = load_structure(path)
    except InputError:
        return
    same(original, read)  # a byte that does not matter
