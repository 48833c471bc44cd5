"""The structure type, its names, and joining."""

import numpy as np
import pytest
import scipy.sparse

from stickslip.errors import InputError
from stickslip.model.matrices import chain, lumped
from stickslip.model.rigid.body import RigidBody
from stickslip.model.structure import Dofs, Structure, join, modal_dofs, nodal_dofs
from stickslip.reduction.fixed_interface import craig_bampton


def test_labels_name_part_node_and_component():
    body = RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), centre=(0.0, 0.0, 0.0)).structure()
    whole = join(blades=chain(2, 1.0, 1.0), damper=body)
    assert whole.dofs.labels[:2] == ("blades.node0.x", "blades.node1.x")
    assert whole.dofs.labels[-1] == "damper.rz"
    assert modal_dofs(1).labels == ("mode",)


def test_nodal_dofs_are_node_major():
    table = nodal_dofs(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), np.array([7, 9]))
    assert table.component == ("x", "y", "z", "x", "y", "z")
    assert table.node.tolist() == [7, 7, 7, 9, 9, 9]
    assert table.take(np.array([3])).position.tolist() == [[4.0, 5.0, 6.0]]


@pytest.mark.parametrize("sparse", [False, True])
def test_join_is_block_diagonal_and_renames_sets(sparse):
    first, second = chain(2, 1.0, 10.0), lumped([2.0], [[5.0]], names=["tip"])
    if sparse:
        first = Structure(
            *(scipy.sparse.csr_array(m) for m in (first.mass, first.damping, first.stiffness)), first.dofs
        )
    whole = join(a=first, b=second)
    stiffness = whole.stiffness.toarray() if sparse else whole.stiffness
    np.testing.assert_array_equal(stiffness, [[20, -10, 0], [-10, 10, 0], [0, 0, 5]])
    assert {k: v.tolist() for k, v in whole.sets.items()} == {"a": [0, 1], "b": [2], "b.tip": [2]}


def test_shapes_must_agree():
    dofs = Dofs(np.arange(2), ("x", "x"), np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"Structure.damping: shape \(3, 3\) for 2 dofs"):
        Structure(np.eye(2), np.eye(3), np.eye(2), dofs)
    with pytest.raises(ValueError, match="Dofs: 1 components"):
        Dofs(np.arange(2), ("x",), np.zeros((2, 3)))


def test_unknown_set_gets_a_suggestion():
    named = lumped([1.0, 1.0], np.eye(2), names=["tip", "hub"])
    with pytest.raises(InputError, match=r"there is no set 'tipp'.*Did you mean 'tip'"):
        named.dof_set("tipp")


def test_expand_without_reduction_is_the_identity():
    full = chain(3, 1.0, 1.0)
    vector = np.arange(3.0)
    assert full.expand(vector) is vector
    small = craig_bampton(full, np.array([2]), 2)
    assert small.expand(np.eye(3)).shape == (3, 3)


@pytest.mark.parametrize("part", ["mass", "damping"])
def test_chain_matrices(part):
    small = chain(3, mass=0.5, stiffness=4.0, damping_factor=0.25)
    expected = {"mass": 0.5 * np.eye(3), "damping": [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]}
    np.testing.assert_array_equal(getattr(small, part), expected[part])


def test_printing_one_says_what_it_is_without_its_matrices():
    """The text of a dataclass would hold all numbers of all matrices."""
    full = chain(12, 1.0, 1.0)
    full = Structure(full.mass, full.damping, full.stiffness, full.dofs, {"tip": np.array([11]), "all": np.arange(12)})
    assert repr(full) == "<Structure: 12 dofs; dense real; sets tip (1), all (12)>"
    small = craig_bampton(full, full.dof_set("tip"), 2)
    expected = "3 dofs; dense real; in other coordinates than the 12 dofs of its model; sets tip (1), modes (2)"
    assert str(small) == f"<Structure: {expected}>"
    many = Structure(
        *(scipy.sparse.csr_array(1j * m) for m in (full.mass, full.damping, full.stiffness)),
        full.dofs,
        {f"set{i}": np.arange(i) for i in range(30)},
        loss=full.stiffness,
    )
    assert repr(many).startswith("<Structure: 12 dofs; sparse complex; structural damping; sets set0 (0), ")
    assert repr(many).endswith("set7 (7) and 22 more>")
    assert repr(Structure(*(np.eye(1),) * 3, modal_dofs(1))) == "<Structure: 1 dofs; dense real; no sets>"
