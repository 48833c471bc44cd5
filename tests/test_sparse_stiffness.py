"""Structures that are not reduced: sparse products against arrays, and the same motions as after an exact condensation."""

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
from newton_bounds import unknowns_bound

from evidence.models.many_contacts import Plates, unreduced_plates
from stickslip.assembly.assembling import assemble
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.contact.product import harmonic_means
from stickslip.errors import InputError, SingularError
from stickslip.harmonic import shared_factor as shared_factor_module
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import CondensedStiffness
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.factors import SparseFactors
from stickslip.harmonic.linear import Shareable, one_structure
from stickslip.harmonic.shared_factor import SharedFactor
from stickslip.harmonic.sparse_stiffness import SparseStiffness, Unreduced, keep_all
from stickslip.harmonic.structured import HarmonicFactors, StructuredJacobian, real_matrix
from stickslip.model.damping import structural_damping
from stickslip.model.modes import normal_modes
from stickslip.response.equilibrium import bonded_start, preload
from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.krylov import Krylov
from stickslip.solve.newton_method import Newton, newton
from stickslip.study.models.study import read_study

EXAMPLE = Path(__file__).parents[1] / "examples" / "root_joint"
ORDER, SAMPLES, OMEGA = 3, 64, 2 * np.pi * 1600.0


@cache
def plates(points: int = 8) -> Plates:
    return unreduced_plates(points)


def reduced(system: System) -> System:
    """The same system, condensed exactly to its contacts."""
    return replace(system, structure=system.structure.structure)


def balance_of(system: System, share: float, points: int = 8, order: int = ORDER) -> HarmonicBalance:
    linear = system.condensed(plates(points).load(share, "slide"), order)
    return harmonic_balance(linear, system.interface, order, SAMPLES, jacobian="structured")


def solved(system: System, share: float, points: int) -> tuple[HarmonicBalance, np.ndarray]:
    balance = balance_of(system, share, points)
    start = bonded_start(balance, OMEGA, system)
    found = newton(lambda x: balance.linearise(x, OMEGA), start, Newton(tolerance=1e-11))
    assert found.status.converged
    return balance, found.x


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


@pytest.fixture(scope="module")
def lossy() -> SparseStiffness:
    """A sparse structure with Coriolis terms, structural damping and a load in two harmonics."""
    own = plates().system.structure.structure
    rng = np.random.default_rng(3)
    half = scipy.sparse.random_array((own.n, own.n), density=0.02, rng=rng, data_sampler=rng.standard_normal)
    skew = abs(own.damping).max() * (half - half.T)
    turning = structural_damping(own.with_damping(own.damping + skew), 0.02)
    force = rng.standard_normal((2, own.n)) + 1j * rng.standard_normal((2, own.n))
    return keep_all(turning, HarmonicLoad(rng.standard_normal(own.n), {1: force[0], 3: force[1]}))


# ---- products -------------------------------------------------------------------------------------------------------------


def test_products_are_those_of_the_arrays(lossy):
    own = lossy.matrices
    k, c, m, loss = (a.toarray() for a in (own.stiffness, own.damping, own.mass, own.loss))
    harmonics = (0, 1, 3)
    blocks = [k + 0j] + [k + 1j * loss + 1j * h * OMEGA * c - (h * OMEGA) ** 2 * m for h in harmonics[1:]]
    whole = real_matrix(blocks)
    at = lossy.products(OMEGA, harmonics)
    assert isinstance(at, Shareable)
    rows = np.random.default_rng(0).standard_normal((5, lossy.n))
    assert relative(at.product(rows).ravel(), whole @ rows.ravel()) < 1e-13
    assert relative(at.transposed_product(rows).ravel(), whole.T @ rows.ravel()) < 1e-13
    for h, block in zip(harmonics, blocks, strict=True):
        assert relative(at.block(h).toarray(), block) < 1e-15
    condensed = lossy.condensed(OMEGA, 3)
    assert relative(condensed.stiffness[[0, 1, 3]], np.array(blocks)) < 1e-15
    np.testing.assert_array_equal(condensed.load[3], lossy.load.harmonics[3])


def test_slopes_are_those_of_differences(lossy):
    rows = np.random.default_rng(0).standard_normal((7, lossy.n))
    step = 1e-3 * OMEGA  # the dynamic stiffness is quadratic in ω: central differences are exact but for rounding
    side = [lossy.products(OMEGA + s, (0, 1, 2, 3)).product(rows) for s in (-step, step)]
    product, slope = lossy.products(OMEGA, (0, 1, 2, 3)).product_and_slope(rows)
    assert relative(product, np.mean(side, axis=0)) < 1e-3
    assert relative(slope, (side[1] - side[0]) / (2 * step)) < 1e-8
    blocks = [lossy.condensed(OMEGA + s, 2).stiffness for s in (-step, step)]
    by_omega = lossy.condensed(OMEGA, 2).derivative
    assert relative(by_omega, (blocks[1] - blocks[0]) / (2 * step)) < 1e-8


def test_mode_projection_is_that_of_the_arrays(lossy):
    at = lossy.products(OMEGA, (0, 1, 2))
    vectors = np.random.default_rng(0).standard_normal((lossy.n, 4))
    other = lossy.products(1.3 * OMEGA, (0, 1, 2))
    for h in (0, 2):
        seen = at.projected(vectors).moved_to(other).block(h)
        assert relative(seen, vectors.T @ other.block(h).toarray() @ vectors) < 1e-12


def test_mass_damping_is_added(lossy):
    more = lossy.with_mass_damping(7.0).products(OMEGA, (0, 1)).block(1)
    added = more - lossy.products(OMEGA, (0, 1)).block(1)
    assert relative(added.toarray(), 7j * OMEGA * lossy.matrices.mass.toarray()) < 1e-6


# ---- the same motions ---------------------------------------------------------------------------------------------------


@pytest.mark.kernel
@pytest.mark.parametrize("points", [8, 24])
def test_motion_is_that_of_the_condensed_structure(points):
    system = plates(points).system
    sparse, x = solved(system, 0.4, points)
    dense, y = solved(reduced(system), 0.4, points)
    assert isinstance(sparse.linear, SparseStiffness)
    assert isinstance(dense.linear, CondensedStiffness)
    assert 0.1 < np.mean(dense.contacts(y, OMEGA).state == 1) < 0.9
    q = sparse.coefficients(x)
    z = dense.unknowns(q[:, dense.linear.retained])
    assert np.abs(z - y).max() <= unknowns_bound(y, *(dense.linearise(v, OMEGA) for v in (z, y)))
    full = dense.linear.recover(OMEGA, dense.coefficients(z))
    assert relative(q, full) < 1e-8
    energy = sparse.linear.strain_energy(OMEGA, q)
    np.testing.assert_allclose(energy, dense.linear.strain_energy(OMEGA, full[:, dense.linear.retained]), rtol=1e-8)
    outputs = system.outputs
    np.testing.assert_array_equal(sparse.linear.output_rows(OMEGA, 1, outputs) @ q[1], q[1][outputs])


def test_arc_length_finds_the_branch_of_the_condensed_structure():
    system, load = plates().system, plates().load(0.2, "slide")
    first = np.sqrt(normal_modes(system.stuck_structure(), 1).squares[0])
    sweep = Sweep(
        omega_range=(0.95 * first, 1.02 * first),
        selection="always_high",
        high=ORDER,
        samples=SAMPLES,
        evaluator="intervals",
        points=4,
        peak_points=0,
        newton=Newton(tolerance=1e-10),
    )
    points = list(forced_response(system, load, sweep))
    assert len(points) >= 4
    assert all(p.converged for p in points)
    judge = forced_problem(reduced(system), load, sweep).high
    for p in points:
        x = judge.unknowns(p.coefficients[:, judge.linear.retained])
        found = newton(lambda v, w=p.omega: judge.linearise(v, w), x, Newton(tolerance=1e-11))
        reached = (judge.linearise(v, p.omega) for v in (x, found.x))
        assert np.abs(x - found.x).max() <= unknowns_bound(x, *reached)


def test_static_seat_is_that_of_the_condensed_structure():
    system = plates().system
    static = (
        plates().load(0.0).static
        + 1e3 * np.random.default_rng(0).standard_normal(system.structure.n) / system.structure.n
    )
    dense = reduced(system)
    found = preload(system, static)
    assert relative(found[dense.retained], preload(dense, static)) < 1e-8


def test_harmonics_are_raised_as_in_the_condensed_structure():
    system, load = plates().system, plates().load(0.2, "slide")
    first = np.sqrt(normal_modes(system.stuck_structure(), 1).squares[0])
    sweep = Sweep(omega_range=(0.9 * first, first), at=(0.95 * first,), samples=128, cap=5)
    both = [list(forced_response(s, load, sweep)) for s in (system, reduced(system))]
    sparse, dense = ([p for p in points if p.stage != "peak"] for points in both)
    assert [p.support for p in sparse] == [p.support for p in dense]
    assert len({p.support for p in sparse}) > 1
    np.testing.assert_allclose([p.predicted_error for p in sparse], [p.predicted_error for p in dense], rtol=1e-3)


# ---- factors ------------------------------------------------------------------------------------------------------------


def jacobian(share: float = 0.4) -> tuple[StructuredJacobian, np.ndarray]:
    balance, x = solved(plates().system, share, 8)
    at = balance.linearise(0.9 * x, OMEGA)
    return at.jac, -at.residual


def test_one_factor_serves_all_harmonics():
    jac, right = jacobian()
    kept = jac.preconditioner()
    assert isinstance(kept, SharedFactor)
    assert isinstance(kept.factor, SparseFactors)
    assert kept.factor.dtype == np.float32
    krylov = Krylov(tolerance=1e-10)
    found = krylov.solve(jac, right)
    assert krylov.counts.products < 60
    assert relative(found, np.linalg.solve(jac.dense(), right)) < 1e-7
    a, b = np.random.default_rng(7).standard_normal((2, right.size))
    solve, back = jac.preconditioned_by(kept)[0], jac.transposed.preconditioned_by(kept)[0]
    assert abs(solve(a) @ b - a @ back(b)) <= 1e-4 * np.linalg.norm(solve(a)) * np.linalg.norm(b)


def test_factors_by_harmonic_hold_all_below_the_harmonics():
    jac, _ = jacobian()
    kept = jac.better_preconditioner(jac.preconditioner())
    assert isinstance(kept, HarmonicFactors)
    solve, product = jac.preconditioned_by(kept)
    v = np.random.default_rng(0).standard_normal(jac.shape[0])
    solution = solve(v)
    assert relative(product(solution, v), jac.matvec(solution)) < 1e-8
    # static rows do not feel what is above them in P
    n = jac.linear.n
    static = harmonic_means(jac.blocks)[0].real
    own = jac.scale * jac.linear.static(static, jac.rows).toarray()
    assert relative(own @ solution[:n], v[:n]) < 1e-9


def test_double_precision_where_single_tells_too_little(monkeypatch):
    monkeypatch.setattr(shared_factor_module, "MAX_SINGLE_RESIDUAL", 1e-7)
    assert jacobian()[0].preconditioner().factor.dtype == np.float64


# ---- from a study file ----------------------------------------------------------------------------------------------------


def test_parts_kept_whole_are_not_condensed_where_they_are_too_large(tmp_path, monkeypatch):
    text = (EXAMPLE / "study.toml").read_text().replace("fixed_interface_modes = 20", 'method = "none"')
    for name in ("blade.inp", "disk.inp"):
        shutil.copy(EXAMPLE / name, tmp_path)
    (tmp_path / "study.toml").write_text(text)
    model = read_study(tmp_path / "study.toml").model()
    condensed = assemble(model, 1)
    monkeypatch.setattr("stickslip.assembly.sides.unreduced.LARGEST_INTERIOR", 100)
    whole = assemble(model, 1)
    assert not isinstance(condensed.system.structure, Unreduced)
    assert isinstance(whole.system.structure, Unreduced)
    assert relative(whole.static_force, condensed.static_force) < 1e-8
    sweep = Sweep(
        omega_range=(2 * np.pi * 1900, 2 * np.pi * 1950),
        at=(2 * np.pi * 1920,),
        low=1,
        high=1,
        selection="always_high",
        samples=SAMPLES,
        evaluator="intervals",
        peak_points=0,
        newton=Newton(tolerance=1e-10),
    )
    found = []
    for one in (whole, condensed):
        problem = forced_problem(one.system, one.load, sweep)
        (point,) = forced_response(one.system, one.load, sweep)
        assert point.converged
        found.append(problem.low.linear.recover(point.omega, point.coefficients))
    assert relative(*found) < 1e-7


# ---- what it does not do ------------------------------------------------------------------------------------------------


def test_few_dofs_are_arrays():
    own = plates().system.structure.structure
    held = np.arange(60)
    few = replace(
        own,
        mass=own.mass[held][:, held],
        damping=own.damping[held][:, held],
        stiffness=own.stiffness[held][:, held],
        dofs=replace(
            own.dofs, node=own.dofs.node[held], component=own.dofs.component[:60], position=own.dofs.position[held]
        ),
    )
    interface = plates().system.interface
    one = replace(interface, names=("a",), laws=interface.laws[:1], gap_operator=np.eye(3, 60))
    system = System(Unreduced(few), one, np.array([0]))
    linear = system.condensed(HarmonicLoad(np.zeros(60), {1: np.ones(60)}), 1)
    assert isinstance(linear, CondensedStiffness)
    assert linear.n == 60


def test_other_analyses_refuse_it():
    with pytest.raises(InputError, match="stability: has no form for an unreduced structure"):
        one_structure(plates().system.structure, "stability")


def test_arrays_of_large_structures_are_refused(monkeypatch):
    monkeypatch.setattr("stickslip.harmonic.factors.LARGEST_ARRAY", 100)
    jac, _ = jacobian()
    with pytest.raises(InputError, match="craig_bampton"):
        jac.dense()


def test_rigid_contacts_are_refused():
    system = plates().system
    own = system.interface
    laws = (RigidCoulomb(mu=0.3, preload=1.0), *own.laws[1:])
    with pytest.raises(InputError, match="rigid contact"):
        replace(system, interface=replace(own, laws=laws))


def test_body_held_by_nothing_is_named():
    system = plates().system
    own = system.structure.structure
    stiffness = own.stiffness.tolil()
    stiffness[5, :] = stiffness[:, 5] = 0.0
    loose = Unreduced(replace(own, stiffness=stiffness.tocsr()))
    with pytest.raises(SingularError, match="held by nothing"):
        preload(replace(system, structure=loose), plates().load(0.0).static)


@pytest.mark.parametrize("name", ["mass", "stiffness"])
def test_matrices_that_are_not_symmetric_are_refused(name):
    own = plates().system.structure.structure
    matrix = getattr(own, name).tolil()
    matrix[0, 1] = abs(getattr(own, name)).max()
    with pytest.raises(InputError, match="is not symmetric"):
        keep_all(replace(own, **{name: matrix.tocsr()}), HarmonicLoad(np.zeros(own.n)))
