"""The structure type, its names, and joining."""

import numpy as np
import pytest
import scipy.sparse

from stickslip.errors import InputError
from stickslip.model.dofs import Dofs, modal_dofs, nodal_dofs
from stickslip.model.lumped import chain, lumped
from stickslip.model.rigid_body import RigidBody
from stickslip.model.structure import Structure, join
from stickslip.reduction.craig_bampton import craig_bampton


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
            *(scipy.sparse.csr_array(m) for m in (first.mass, first.damping, first.stiffness)),
            first.dofs,
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
    expected = {
        "mass": 0.5 * np.eye(3),
        "damping": [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]],
    }
    np.testing.assert_array_equal(getattr(small, part), expected[part])
