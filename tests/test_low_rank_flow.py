"""The exponentials of contact states that differ in a few springs, against those of the full matrices."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.model.matrices import lumped
from stickslip.response.stability.flow_map import low_rank_flow
from stickslip.response.stability.flow_map.contact_states import ContactStates
from stickslip.response.stability.flow_map.low_rank_flow import HYPERBOLA, NODES, REACH, FullFlow, LowRankFlow, flow_of
from stickslip.response.stability.flow_map.modal_states import ModalStates, modal_states
from stickslip.response.stability.flow_map.propagation import transition

N = 52  # coordinates


def states(held=1.0, damping=2e-3):
    """Return modal states with overdamped modes, and 24 intervals in which two contacts stick, slip and open; `held` keeps all modes from moving freely."""
    rng = np.random.default_rng(3)
    speed = np.geomspace(1.0, 800.0, N)
    gaps = 0.2 * rng.standard_normal((6, N)) * speed**0.5
    modes = ModalStates(1.0, held * np.diag(speed**2), np.diag(0.01 + damping * speed**2), speed, gaps, np.eye(N))
    length = 2.0 * np.pi / 24.0
    stick = np.arange(24) % 4 != 1
    open_ = np.arange(24) % 6 == 5
    stiffness = np.zeros((24, 2, 3, 3))
    stiffness[:, :, 2, 2] = 40.0 * ~open_[:, None]
    stiffness[:, 0, 0, 0] = 30.0 * stick
    stiffness[:, 0, 0, 2] = -12.0 * ~stick
    times = np.concatenate([np.cumsum(length * np.linspace(0.1, 1.9, 25)), [0.0]])
    return modes, ContactStates(
        np.append(times[:24], times[0] + 2.0 * np.pi),
        stiffness,
        np.array([0]),
        np.array([2]),
        np.array([30.0]),
        stick[:, None],
        np.zeros((24, 1), dtype=bool),
        np.zeros((24, 1)),
        0,
        0,
        0,
        24,
    )


def test_nodes_are_exact_within_the_hyperbola():
    z, weights = (values[:NODES] for values in HYPERBOLA)
    along, down = np.linspace(0.0, REACH, 40), np.geomspace(1e-3, 1e5, 60)
    inside = np.concatenate([1j * along, -down, 1j * REACH - down * (1.0 + 1j), 1j * along - 1.0])
    found = np.sum(weights / (z - inside[:, None]) + weights.conj() / (z.conj() - inside[:, None]), 1)
    np.testing.assert_allclose(0.5 * found, np.exp(inside), atol=5e-13)


@pytest.mark.parametrize("length", [0.0, 1e-3, 0.05, 1.0])
def test_intervals_are_those_of_the_full_matrix(length):
    modes, contacts = states()
    flow, full = flow_of(modes, contacts), FullFlow(modes, contacts)
    assert isinstance(flow, LowRankFlow)
    motion, sliders = np.eye(2 * N, 2 * N + 1), np.eye(1, 2 * N + 1, 2 * N)
    ranks = set()
    for interval in range(6):
        ranks.add(np.count_nonzero(contacts.stiffness[interval] != flow.base))
        expected = full.advance(interval, length, motion, sliders)
        found = flow.out @ flow.advance(interval, length, flow.into @ motion, sliders)
        np.testing.assert_allclose(found, expected, atol=2e-11 * np.max(np.abs(expected)))
    assert {0, 2} < ranks


def test_nodes_that_do_not_suffice_are_noticed(monkeypatch):
    modes, contacts = states()
    flow, full = flow_of(modes, contacts), FullFlow(modes, contacts)
    assert isinstance(flow, LowRankFlow)
    interval = int(np.flatnonzero(np.any(contacts.stiffness != flow.base, axis=(1, 2, 3)))[0])
    contacts.stiffness[interval, 0, 1, 1] = 1e5  # rings far beyond the base's eigenvalues
    expected = full.advance(interval, 0.3, np.eye(2 * N), np.zeros((1, 2 * N)))
    failed = []
    tried = LowRankFlow._transition

    def counted(*given):
        out = tried(*given)
        failed.append(out is None)
        return out

    monkeypatch.setattr(LowRankFlow, "_transition", counted)
    found = flow.out @ flow.advance(interval, 0.3, flow.into.copy(), np.zeros((1, 2 * N)))
    assert failed[0]
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.max(np.abs(expected)))


def test_free_bodies_and_small_structures_take_full_matrices(monkeypatch):
    modes, contacts = states(held=0.0, damping=0.0)
    modes.damping[:] = 0.0
    contacts.stiffness[:] *= np.linspace(1.0, 1.0 + 1e-9, 24)[:, None, None, None] - 1.0
    assert isinstance(flow_of(modes, contacts), FullFlow)
    monkeypatch.setattr(low_rank_flow, "FEW", N + 1)
    assert isinstance(flow_of(*states()), FullFlow)


@pytest.mark.parametrize("stiffness", [1e60, 1e90, 1e300])
def test_a_motion_too_fast_for_a_number_says_so(stiffness: float) -> None:
    """Before, squares of squares went to NaN or lost every digit, and the motion counted as stable."""
    matrix = np.array([[0.0, 1.0], [-stiffness, -1.0]])
    with pytest.raises(FloatingPointError, match="too fast for a number"):
        transition(matrix, np.zeros((1, 0)), 1.0)


def test_the_coordinate_without_mass_is_named():
    body = lumped(np.ones(3), np.eye(3))
    bare = replace(body, mass=np.diag([2.0, 0.0, 1.0]))
    with pytest.raises(InputError, match=r"smallest diagonal entry 0 at node1\.x.*condense the massless ones"):
        modal_states(bare, np.zeros((0, 3)), np.zeros(0), 1.0)
