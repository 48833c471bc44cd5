"""What vibrates may be one structure, a wheel, or anything whose harmonics have matrices of their own, complex and unsymmetric ones."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from newton_bounds import FINE, unknowns_bound
from test_reduced_wheel import TILTED, shrouded
from test_wheel_coordinates import dense

import stickslip as ss
from evidence.models.lumped import blades_and_damper
from evidence.models.lumped_disks import TIP, friction_ring
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.contact.neighbours import neighbour_gaps, neighbour_interface
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dynamic_stiffness import CondensedStiffness
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.harmonic.travelling import ModalWave, SolvedWave, TravellingStiffness, condense_side, condense_wave
from stickslip.model.structure import Structure, modal_dofs
from stickslip.reduction.basis import in_coordinates
from stickslip.reduction.cyclic import travelling_wave
from stickslip.reduction.full_wheel import wheel
from stickslip.reduction.tuned import tuned_wheel
from stickslip.reduction.whole_wheel import reduced_wheel
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.parameter import Discretisation
from stickslip.response.recovery import fields
from stickslip.response.resonances.tracking import track_peak
from stickslip.response.rigid import rigid_response
from stickslip.response.system import System
from stickslip.response.time.shooting import shoot
from stickslip.response.time.transient import integrate
from stickslip.solve.krylov import Krylov

N, ORDER, OMEGA = 9, 4, 0.7
NEAR = np.array([1, 4, 7])


@dataclass(frozen=True)
class Side:
    """Harmonics with structures of their own."""

    structures: tuple

    @property
    def n(self):
        return self.structures[0].n

    @property
    def dofs(self):
        return self.structures[0].dofs

    @property
    def multipliers(self):
        return np.zeros(0, dtype=np.int64)

    @property
    def reduced(self):
        return True

    @property
    def harmonics(self):
        return None

    def at_frequency(self, omega):
        return self

    def of_harmonic(self, harmonic):
        return self.structures[harmonic]

    def feedback_of(self, harmonic):
        return None


def odd(seed):
    """Return complex matrices without any symmetry."""
    rng = np.random.default_rng(seed)

    def part(size):
        return size * (rng.standard_normal((N, N)) + 1j * rng.standard_normal((N, N)))

    own = [np.eye(N) + part(0.1), 0.1 * np.eye(N) + part(0.02), 5 * np.eye(N) + part(0.8)]
    return Structure(*own, modal_dofs(N), loss=part(0.1))


def hermitian(seed):
    """Return a wave with Rayleigh and structural damping, whose interior falls apart into its modes."""
    mass, stiffness = ((a + a.conj().T) / 2 for a in (odd(seed).mass, odd(seed).stiffness))
    damping = 0.1 * mass + 0.03 * stiffness
    return Structure(mass, damping, stiffness, modal_dofs(N), loss=0.02 * stiffness)


def some_load(seed=1):
    rng = np.random.default_rng(seed)
    pairs = rng.standard_normal((2, 2, N))
    return HarmonicLoad(rng.standard_normal(N), {1: pairs[0, 0] + 1j * pairs[0, 1], 3: pairs[1, 0]})


SIDES = {
    "one structure": odd(0),
    "waves": Side(tuple(odd(i) for i in range(ORDER + 1))),
    "hermitian waves": Side(tuple(hermitian(i) for i in range(ORDER + 1))),
}


def direct(side, h, omega):
    """Return the dynamic stiffness of all dofs."""
    s = side.of_harmonic(h)
    if h == 0:
        return s.stiffness.real.astype(complex)
    return s.stiffness + 1j * s.loss + 1j * h * omega * s.damping - (h * omega) ** 2 * s.mass


@pytest.fixture(params=SIDES)
def side(request):
    return SIDES[request.param]


def test_complex_unsymmetric_matrices_against_direct_solutions(side):
    load = some_load()
    linear = condense_side(side, NEAR, load, ORDER)
    assert isinstance(linear, TravellingStiffness)
    far = np.setdiff1d(np.arange(N), NEAR)
    rng = np.random.default_rng(5)
    q = rng.standard_normal((ORDER + 1, NEAR.size)) + 1j * rng.standard_normal((ORDER + 1, NEAR.size))
    q[0] = q[0].real
    found, moved = linear.condensed(OMEGA, ORDER), linear.recover(OMEGA, q)
    changed = linear.recover_change(OMEGA, q)
    f = load.coefficients(ORDER)
    for h in range(ORDER + 1):
        D = direct(side, h, OMEGA)
        inner = np.linalg.inv(D[np.ix_(far, far)])
        across = D[np.ix_(NEAR, far)] @ inner
        Z = D[np.ix_(NEAR, NEAR)] - across @ D[np.ix_(far, NEAR)]
        np.testing.assert_allclose(found.stiffness[h], Z, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(found.load[h], f[h, NEAR] - across @ f[h, far], atol=1e-12)
        # all forces that are needed for this motion act on the retained dofs
        left = D @ moved[h] - f[h]
        assert np.abs(left[far]).max() < 1e-12
        np.testing.assert_allclose(left[NEAR], Z @ q[h] - found.load[h], atol=1e-11)
        assert np.abs((D @ changed[h])[far]).max() < 1e-12
        rows = linear.output_rows(OMEGA, h, np.array([0, 4, 8]))
        np.testing.assert_allclose(rows @ q[h], changed[h][[0, 4, 8]], atol=1e-12)
    energy = linear.strain_energy(OMEGA, q)
    assert np.isrealobj(energy)
    x = moved[2]
    expected = 0.25 * (x.conj() @ side.of_harmonic(2).stiffness @ x).real
    assert energy[2] == pytest.approx(expected, rel=1e-12)


def test_the_interior_is_written_in_modes_where_they_decouple_it():
    """So that the tests with `SIDES` are of both roads."""

    def kind(structure):
        return condense_wave(structure, NEAR, np.setdiff1d(np.arange(N), NEAR), mean=False)

    wave = hermitian(3)
    assert isinstance(kind(wave), ModalWave)
    other = wave.damping.copy()
    other[0, 0] += 0.1
    skew = wave.damping + 1e-3 * (np.triu(np.ones((N, N)), 1) - np.tril(np.ones((N, N)), -1))
    near_loss = wave.loss.copy()
    near_loss[0, 1] += 0.1
    near_loss[1, 0] += 0.1
    for part in ({"damping": other}, {"damping": skew}, {"loss": near_loss}):
        assert isinstance(kind(replace(wave, **part)), SolvedWave)
    assert isinstance(kind(replace(wave, stiffness=wave.stiffness - 9 * np.eye(N))), SolvedWave)


def test_derivatives_and_products_of_complex_unsymmetric_matrices(side):
    linear = condense_side(side, NEAR, some_load(), ORDER)
    step = 1e-6
    there, back = (linear.condensed(OMEGA + d, ORDER) for d in (step, -step))
    here = linear.condensed(OMEGA, ORDER)
    for value, slope in (("stiffness", "derivative"), ("load", "load_derivative")):
        by_differences = (getattr(there, value) - getattr(back, value)) / (2 * step)
        np.testing.assert_allclose(getattr(here, slope), by_differences, atol=1e-7)
    products = linear.products(OMEGA, harmonics_of((1, 3)))
    rng = np.random.default_rng(2)
    rows, other = rng.standard_normal((2, 5, NEAR.size))
    whole = StructuredJacobian(products, np.zeros((0, 5, 5, 5)), _no_contacts(), 1.0).dense()  # the real form of Z
    np.testing.assert_allclose(products.product(rows).ravel(), whole @ rows.ravel(), atol=1e-12)
    np.testing.assert_allclose(products.transposed_product(other).ravel(), whole.T @ other.ravel(), atol=1e-12)
    slope = products.product_and_slope(rows)[1]
    ahead, behind = (linear.products(OMEGA + d, harmonics_of((1, 3))) for d in (step, -step))
    np.testing.assert_allclose(slope, (ahead.product(rows) - behind.product(rows)) / (2 * step), atol=1e-7)


def _no_contacts():
    from stickslip.contact.interface import sparse_rows

    return sparse_rows(Interface((), (), np.zeros((0, NEAR.size))).gap_operator)


def test_a_forced_response_with_complex_unsymmetric_matrices(side):
    """Residual of all dofs in the frequency domain, friction forces included."""
    operator = np.zeros((3, N))
    operator[0, 1], operator[2, 4] = 1.0, 1.0
    law = ElasticCoulomb(k_t=2.0, k_w=0.0, k_n=1.0, mu=0.3, preload=0.5)
    system = System(side, Interface(("c",), (law,), operator), np.array([0, 1]))
    sweep = Sweep(omega_range=(0.6, 0.8), at=(0.6, OMEGA), low=3, high=4, selection="jacobian_alert", peak_points=0)
    load = some_load()
    problem = forced_problem(system, load, sweep)
    points = accepted_points(list(forced_response(system, load, sweep)))
    for point in points:
        assert point.converged
        found = fields(problem, point)
        moved = problem.low.linear.recover(point.omega, point.coefficients)
        f = load.coefficients(ORDER)
        for h in range(point.order + 1):
            left = direct(side, h, point.omega) @ moved[h] + operator.T @ found.forces[h, 0] - f[h]
            assert np.abs(left.real if h == 0 else left).max() < 1e-8
    assert found.energy[0] > 1e-3


def test_one_real_symmetric_structure_keeps_its_fast_condensation():
    system, load = blades_and_damper()
    assert isinstance(system.condensed(load, 3), CondensedStiffness)
    assert system.plain_structure is system.structure
    same = replace(system, structure=Side((system.structure,) * 4))
    assert isinstance(same.condensed(load, 3), CondensedStiffness)


# ---- wheels -----------------------------------------------------------------------------------------------------------------

PLACE = {"low": "left", "high": "right", "axis": TILTED, "normal": np.array([0.6, 0.0, 0.8])}


def lopsided(sectors=5):
    """Return a shrouded sector with complex unsymmetric matrices, and the dofs of its shrouds."""
    sector, (low, high) = shrouded(sectors)
    free = sector.structure
    rng = np.random.default_rng(7)
    more = rng.standard_normal((2, free.n, free.n)) / free.n
    stiffness = dense(free.stiffness) + 0.3 * (more[0] + 1j * more[1])
    structure = replace(free, stiffness=stiffness, mass=dense(free.mass), damping=dense(free.damping))
    return replace(sector, structure=structure), low, high


def test_waves_of_complex_sectors_are_not_each_others_mirror():
    sector, low, high = lopsided()
    ahead, back = travelling_wave(sector, 1), travelling_wave(sector, 4)
    assert np.abs(back.stiffness - ahead.stiffness.conj()).max() > 0.01
    gaps = neighbour_gaps(sector.structure, 5, **PLACE)
    keep = np.concatenate([low, high])

    def unreduced(wave, first, _):
        rest = np.setdiff1d(np.arange(wave.n), first)
        order = np.concatenate([first, rest])
        pick = np.eye(wave.n)[:, order]
        return in_coordinates(wave, pick, wave.dofs.take(order), {})

    # engine order 2 of five sectors: harmonics 0 to 4 travel as 0, 2, 4, 1, 3
    for relative in (None, False):
        side, _ = tuned_wheel(sector, 2, 4, gaps, relative=relative)
        for h, k in enumerate((0, 2, 4, 1, 3)):
            own = side.of_harmonic(h)
            moving = travelling_wave(sector, k)
            assert _apart(_values(own), _values(moving)) < 1e-8
    whole = reduced_wheel(sector, keep, 0, reduce=unreduced)
    full = wheel(sector)
    assert _apart(_values(whole.structure), _values(full)) < 1e-8
    assert len(whole.waves) == 5
    state = np.random.default_rng(0).standard_normal(whole.structure.n)
    assert np.iscomplexobj(whole.expand(state)) or np.isrealobj(whole.structure.stiffness)


def _values(structure):
    return np.linalg.eigvals(np.linalg.solve(dense(structure.mass), dense(structure.stiffness)))


def _apart(values, others):
    """Return the largest distance of one of the values from the nearest of as many others, relative to the largest."""
    assert values.size == others.size
    return np.abs(values[:, None] - others).min(axis=1).max() / np.abs(others).max()


def wheel_with_slipping_ring(order=3):
    tuned, operator = friction_ring(order)
    contacts = Interface(("ring",), (Jenkins(k_t=2e7, limit=4.0),), operator)
    system = System(tuned, contacts, np.array([1]))
    force = np.zeros(6)
    force[TIP] = 1.0
    return system, HarmonicLoad(np.zeros(tuned.n), {1: tuned.project(force, 1)})


def tip_of(side):
    """Return the coordinate that is the motion of the blade's tip."""
    rows = [np.flatnonzero(dense(side.of_harmonic(h).basis)[TIP]) for h in (0, 1)]
    assert rows[0].size == rows[1].size == 1
    return int(rows[1][0])


@pytest.mark.kernel
def test_krylov_steps_on_a_wheel_are_those_of_arrays():
    system, load = wheel_with_slipping_ring()
    linear = system.condensed(load, 3)
    assert isinstance(linear, TravellingStiffness)
    omega = 2 * math.pi * 624
    made = {form: harmonic_balance(linear, system.interface, 3, 64, "events", form) for form in ("dense", "structured")}
    x = np.random.default_rng(0).standard_normal(made["dense"].size)
    one, other = (made[form].linearise(x, omega) for form in ("dense", "structured"))
    assert isinstance(other.jac, StructuredJacobian)
    np.testing.assert_allclose(one.residual, other.residual, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(one.jac_p, other.jac_p, rtol=1e-10, atol=1e-14)
    v = np.random.default_rng(1).standard_normal(x.size)
    scale = np.abs(one.jac).max()
    assert np.abs(one.jac @ v - other.jac.matvec(v)).max() < 1e-12 * scale
    assert np.abs(one.jac.T @ v - other.jac.rmatvec(v)).max() < 1e-12 * scale
    krylov = Krylov()
    ends = [
        ss.solve.newton(lambda y, b=b: b.linearise(y, omega), np.zeros(x.size), options)
        for b, options in ((made["dense"], FINE), (made["structured"], replace(FINE, linear=krylov)))
    ]
    assert all(end.status.converged for end in ends)
    assert krylov.counts.products > 0
    reached = (b.linearise(end.x, omega) for b, end in zip(made.values(), ends, strict=True))
    assert np.abs(ends[0].x - ends[1].x).max() <= unknowns_bound(ends[0].x, *reached)


@pytest.mark.parametrize("condition", ["horizontal_tangent", "phase_quadrature"])
def test_a_peak_of_a_wheel_is_tracked(condition):
    """The peak of benchmark B9 under more and more friction, each against frequencies beside it."""
    system, load = wheel_with_slipping_ring()
    tip = tip_of(system.structure)
    system = replace(system, outputs=np.array([tip]))
    span = 2 * math.pi * 621, 2 * math.pi * 627
    how = Discretisation(order=3, samples=64)
    peaks = list(track_peak(system, load, "limit", [4.0, 4.4], span, condition, 0, how))
    for peak, limit in zip(peaks, (4.0, 4.4), strict=True):
        assert peak.converged
        laws = (Jenkins(k_t=2e7, limit=limit),)
        changed = replace(system, interface=replace(system.interface, laws=laws))
        at = tuple(float(peak.omega * (1 + s)) for s in (-2e-4, 0.0, 2e-4))
        sweep = Sweep(omega_range=span, at=at, low=3, high=3, samples=64, selection="always_low", peak_points=0)
        problem = forced_problem(changed, load, sweep)
        points = accepted_points(list(forced_response(changed, load, sweep)))
        below, top, above = map(problem.amplitude, points)
        assert top == pytest.approx(peak.amplitude, rel=1e-6)
        if condition == "horizontal_tangent":
            assert max(below, above) < top


def test_rigid_contacts_between_the_sectors_of_a_wheel():
    """The gaps are coordinates of the wheel; against all sectors."""
    sectors, order, m = 3, 2, 1
    sector, (low, high) = shrouded(sectors)
    law = RigidCoulomb(mu=0.3, preload=0.6)
    names = ("shroud",)
    gaps = neighbour_gaps(sector.structure, sectors, **PLACE)
    force = np.zeros(sector.structure.n)
    force[high] = 1.5, 1.0, -0.5
    side, operator = tuned_wheel(sector, m, order, gaps, names=names)
    # neighbours share their samples: a third of a period is five of them
    how = Discretisation(order=order, samples=15)

    def answered(structure, interface, load):
        system = System(structure, interface, np.array([0]))
        point = next(rigid_response(system, load, (0.9, 0.9), discretisation=how, penalty=0.5))
        assert point.converged
        return point

    one = answered(
        side, Interface(names, (law,), operator), HarmonicLoad(np.zeros(side.n), {1: side.project(force, 1)})
    )
    assert np.any(one.state == 1)
    assert np.any(one.state == 0)
    whole = reduced_wheel(sector, np.concatenate([low, high]), sector.independent.size - 6)
    pairs = neighbour_interface(whole.structure, sectors, law, **PLACE)
    structure, gap = ss.reduction.in_relative_coordinates(whole.structure, pairs.gap_operator, pairs.names)
    load = whole.load(force, m)
    turned = structure.basis.T @ load
    everything = answered(
        structure, Interface(pairs.names, pairs.laws, gap), HarmonicLoad(np.zeros(structure.n), {1: turned})
    )
    scale = np.abs(one.contact_force).max()
    assert np.abs(everything.contact_force[0] - one.contact_force[0]).max() < 1e-6 * scale


@pytest.mark.parametrize("analysis", [integrate, shoot])
def test_analyses_in_time_refuse_a_wheel_by_name(analysis):
    system, load = wheel_with_slipping_ring()
    law = ElasticCoulomb(k_t=2e7, k_w=0.0, k_n=0.0, mu=1.0, preload=4.0)
    operator = system.interface.gap_operator
    message = f"{analysis.__name__}: has no form for a tuned wheel.*Take the wheel of all sectors"
    with pytest.raises(ss.InputError, match=message):
        analysis(system.structure, operator, (law,), load, 3900.0, np.array([0]))
    with pytest.raises(ss.InputError, match=f"{analysis.__name__}: needs real matrices"):
        analysis(odd(0), np.zeros((3, N)), (law,), some_load(), 1.0, np.array([0]))
