"""Reduced structures on disk: the same to the last bit, computed once, and again when anything changes."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
import scipy.sparse
from cyclic_models import random_sector, wedge

from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.reduction.cache import cached
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.free_interface import rubin
from stickslip.reduction.truncation import ModesBelow

MATRICES = ("mass", "damping", "stiffness", "basis")


@pytest.fixture(scope="module")
def wave():
    return travelling_wave(cyclic_sector(random_sector(5, inner=4), 5), 2)


def counted(structure, keep, n_modes):
    """`craig_bampton`, counting its calls."""
    counted.calls += 1
    return craig_bampton(structure, keep, n_modes)


@pytest.fixture(autouse=True)
def fresh_count():
    counted.calls = 0


def test_what_is_read_is_what_was_computed(wave, tmp_path):
    keep = wave.dof_set("inner")
    heard = []
    made = cached(counted, wave, keep, 5, folder=tmp_path / "new", say=heard.append)
    read = cached(counted, wave, keep, 5, folder=tmp_path / "new", say=heard.append)
    assert counted.calls == 1
    assert [line.split(" ")[1] for line in heard] == ["kept", "read"]
    for name in MATRICES:
        one, other = getattr(made, name), getattr(read, name)
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    assert read.dofs.labels == made.dofs.labels
    assert {k: v.tolist() for k, v in read.sets.items()} == {k: v.tolist() for k, v in made.sets.items()}


def variants(structure):
    """The same structure with one thing changed."""
    for name in ("mass", "damping", "stiffness"):
        changed = getattr(structure, name).copy()
        changed.data[7] = np.nextafter(changed.data[7].real, np.inf) + 1j * changed.data[7].imag
        yield replace(structure, **{name: changed})
    position = structure.dofs.position.copy()
    position[3, 1] += 1e-12
    yield replace(structure, dofs=replace(structure.dofs, position=position))
    yield replace(structure, sets={"another": structure.sets["inner"], **structure.sets})
    moved = {**structure.sets, "inner": structure.sets["inner"][::-1].copy()}
    yield replace(structure, sets=moved)
    yield replace(structure, basis=2 * structure.basis)
    yield replace(structure, loss=structure.stiffness)


def test_any_change_is_computed_anew(wave, tmp_path):
    keep = wave.dof_set("inner")
    cached(counted, wave, keep, 5, folder=tmp_path)
    for i, other in enumerate(variants(wave)):
        cached(counted, other, keep, 5, folder=tmp_path)
        assert counted.calls == i + 2
    last = counted.calls
    for arguments in ((keep, 6), (keep[::-1].copy(), 5), (keep, ModesBelow(0.1)), (keep, ModesBelow(0.2))):
        cached(counted, wave, *arguments, folder=tmp_path)
        last += 1
        assert counted.calls == last
    assert len(list(tmp_path.glob("*.npz"))) == last
    assert cached(rubin, wave, keep, 5, folder=tmp_path).n == keep.size + 5


@pytest.mark.parametrize("damage", ["cut", "garbled", "empty", "other"])
def test_a_damaged_file_is_computed_again(wave, tmp_path, damage):
    keep = wave.dof_set("inner")
    made = cached(counted, wave, keep, 5, folder=tmp_path)
    (path,) = tmp_path.glob("*.npz")
    whole = path.read_bytes()
    if damage == "cut":
        path.write_bytes(whole[: len(whole) // 2])
    elif damage == "garbled":
        path.write_bytes(bytes(b ^ 0x5A for b in whole))
    elif damage == "empty":
        path.write_bytes(b"")
    else:
        np.savez(path, harmless=np.zeros(3))
    heard = []
    again = cached(counted, wave, keep, 5, folder=tmp_path, say=heard.append)
    assert counted.calls == 2
    assert "is of no use and is computed again" in heard[0]
    np.testing.assert_array_equal(again.stiffness, made.stiffness)
    assert path.read_bytes() == whole or cached(counted, wave, keep, 5, folder=tmp_path).n == made.n
    assert counted.calls == 2  # the file was put right


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(wave, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    heard = []
    made = cached(counted, wave, wave.dof_set("inner"), 5, folder=blocked, say=heard.append)
    assert made.n == wave.dof_set("inner").size + 5
    assert "could not be kept" in heard[0]


def test_nothing_is_left_behind(wave, tmp_path):
    cached(counted, wave, wave.dof_set("inner"), 5, folder=tmp_path)
    assert [p.suffix for p in tmp_path.iterdir()] == [".npz"]


def test_what_cannot_be_compared_is_refused(wave, tmp_path):
    with pytest.raises(InputError, match=r"cached: reduction: .*lambda.* has no name"):
        cached(lambda s: s, wave, folder=tmp_path)
    with pytest.raises(InputError, match="argument 2: a object has no content"):
        cached(counted, wave, wave.dof_set("inner"), object(), folder=tmp_path)
    assert counted.calls == 0


@dataclass(frozen=True)
class Reducer:
    """A reduction with an argument of its own."""

    modes: int

    def reduced(self, structure, keep):
        return craig_bampton(structure, keep, self.modes)

    __call__ = reduced


@pytest.mark.parametrize("of", [lambda r: r, lambda r: r.reduced, lambda r: partial(r.reduced)])
def test_what_has_arguments_of_its_own_is_refused(of, wave, tmp_path):
    """Two such methods have one name: the second would get what the first computed."""
    with pytest.raises(InputError, match="arguments of its own"):
        cached(of(Reducer(5)), wave, wave.dof_set("inner"), folder=tmp_path)


@dataclass(frozen=True)
class Nested:
    axis: Axis
    names: str


def test_dataclasses_count_with_all_they_hold(wave, tmp_path):
    def key(**options):
        from stickslip.reduction.cache import _key

        return _key(counted, wave, (Nested(**options),))

    one = key(axis=Axis(), names="a")
    assert one == key(axis=Axis(), names="a")
    assert len({one, key(axis=Axis((1.0, 0.0, 0.0)), names="a"), key(axis=Axis(), names="b")}) == 3


def test_solids_with_sparse_matrices_are_kept_too(tmp_path):
    structure = assemble_solid(wedge(8), Material())
    assert scipy.sparse.issparse(structure.stiffness)
    keep = structure.dof_set("tip")
    one, other = (cached(craig_bampton, structure, keep, 5, folder=tmp_path) for _ in range(2))
    np.testing.assert_array_equal(one.basis, other.basis)
