"""Validity of the single-mode assumption: linear response of the other modes under the same force.

The other modes are linear, with stuck contacts. Their response is the response of the linear structure without the
followed mode, to the force that remains in the equations of motion of the backbone. While nothing slips, the sum of
both is the exact response. Where contacts slip, the other modes move the contacts too, which the backbone neglects. The
amplitude of a resonance is then wrong by about

    foreign = m max(1 - S, 1/5) + (ζ / δ)² ,

where m is the motion of the other modes over the followed mode, in the output or in the contact gaps; S the growth ``d
ln a / d ln level``, which is small where slip limits the gap; ζ the damping ratio; and δ the relative distance to the
next frequency. `docs/theory/modal_synthesis.md` compares this estimate with solutions.

At a peak the other modes are small beside the followed one; away from it they may reach a fifth. Where the amplitude
grows steeply with the load, as on the flank of a peak that slip softens, a small motion of the other modes has a large
effect. `along` returns where one mode dominates.
"""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix, as_array
from stickslip.model.blas_threads import by_one_thread
from stickslip.model.modes import normal_modes, with_springs
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_basis, in_coordinates
from stickslip.reduction.contact_coordinates import own_motions
from stickslip.response.equilibrium import holding
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator
from stickslip.response.nonlinear_modes.synthesis import Resonance, Synthesised, at_resonance

WHOLE = 300  # coordinates up to which all motions count
LOWEST = 80  # number of modes of larger structures; the static response to the force is added
ACROSS = 0.02  # half the interval of ln a for the growth with the level
WIDTHS = 2.0  # half-widths of a peak within which the other modes may move it
HELD = 0.2  # least share of the other modes that counts
CHANGES = 1e-3  # relative change of frequency or damping from the linear mode that counts as slip
ALONE = 0.05  # largest share of the other modes, and of their effect through the contacts, where one mode dominates
DIFFERENCE = 1e-4  # step of the position for the derivative of the amplitude by the load


@dataclass(frozen=True, eq=False)
class OtherModes:
    """Modes of the linear structure with stuck contacts, without the mode in which the backbone begins.

    Parameters
    ----------
    oscillator
        The backbone and its load.
    poles
        (m,) eigenvalues of the structure, 1/s.
    left, right
        (m, n) and (n, m): the response to a force f is ``right diag(1 / (iΩ - poles)) left f``.
    """

    oscillator: ModalOscillator
    poles: ComplexArray
    left: ComplexArray
    right: ComplexArray

    def answer(self, omega: FloatArray, force: ComplexArray, rows: Matrix) -> ComplexArray:
        """Return the (p, k) response of the other modes in the output `rows` (k, n).

        Forces (p, n) are in N, frequencies (p,) in rad/s.
        """
        taken = (force @ self.left.T) / (1j * omega[:, None] - self.poles)
        here = self.oscillator.at(np.array([self.oscillator.ends[0]]))
        shape = self.oscillator.motion[0, 1] / here.amplitude[0]
        own = (force @ shape.conj()) / here.stiffness(omega)
        return np.asarray(taken @ (rows @ self.right).T - own[:, None] * (rows @ shape))

    def distance(self, omega: float) -> float:
        """Return the distance of the nearest other frequency, relative to `omega`."""
        values = self.poles.imag[self.poles.imag > 0.0]
        mode = self.oscillator.backbone.mode
        own = int(np.argmin(np.abs(values - mode.omega))) if values.size else 0
        others = np.delete(values, own) if values.size else values
        return float(np.min(np.abs(others / omega - 1.0), initial=np.inf))


@dataclass(frozen=True)
class Isolation:
    """Isolation of a mode at a resonance.

    Parameters
    ----------
    output, gaps
        Motion of the other modes over the followed mode, in the output and in the contact gaps.
    distance
        Relative distance of the next frequency.
    overlap
        Damping ratio over that distance.
    growth
        ``d ln a / d ln level``: 1 where the motion is linear.
    harmonics
        Higher harmonics over the first, in the output.
    linear
        Whether nothing slips: then the sum with the other modes is exact.
    """

    output: float
    gaps: float
    distance: float
    overlap: float
    growth: float
    harmonics: float
    linear: bool

    @property
    def foreign(self) -> float:
        """Approximate relative error of the amplitude from neglecting the other modes."""
        if self.linear:
            return 0.0
        share = max(self.output, self.gaps)
        return share * float(np.clip(1.0 - self.growth, HELD, 1.0)) + self.overlap**2


@by_one_thread
def other_modes(oscillator: ModalOscillator) -> OtherModes:
    """Return the linear modes beside the followed one."""
    system = oscillator.backbone.system
    own = system.structure.of_harmonic(1)
    holds = np.repeat(holding(system, oscillator.load.static), 3)
    springs = np.where(holds, system.springs.stuck_stiffness(), 0.0)
    bound = with_springs(own, system.interface.gap_operator, springs)
    way = own_motions(bound, system.structure.multipliers)
    free = in_coordinates(bound, way, bound.dofs.take(np.arange(way.shape[1])), {})
    basis = _basis(free, way.conj().T @ oscillator.load.harmonics[1])
    mass, damping, stiffness = (in_basis(m, basis) for m in (free.mass, free.damping, free.stiffness))
    if free.loss is not None:
        stiffness = stiffness + 1j * in_basis(free.loss, basis)
    n, spread = len(mass), way @ basis
    inner = np.linalg.solve(mass, np.hstack([stiffness, damping, spread.conj().T]))
    zero, one = np.zeros((n, n)), np.eye(n)
    poles, vectors = np.linalg.eig(np.block([[zero, one], [-inner[:, :n], -inner[:, n : 2 * n]]]))
    pulled = np.vstack([np.zeros_like(inner[:, 2 * n :]), inner[:, 2 * n :]])
    return OtherModes(oscillator, poles, np.linalg.solve(vectors, pulled), spread @ vectors[:n])


def left_over(oscillator: ModalOscillator, found: Synthesised) -> ComplexArray:
    """Return the (p, n) residual forces of the equations of motion at synthesised points, N.

    Their modal component is zero.

    Backbone motions have mass-proportional damping instead of the load, and another frequency. Both act on the other
    modes.
    """
    structure = oscillator.backbone.system.structure.of_harmonic(1)
    here = oscillator.at(found.place)
    motion = oscillator.first(found.place) * np.exp(1j * found.phase)[:, None]
    inertia, dashpots = ((m @ motion.T).T for m in (structure.mass, structure.damping))
    off = (found.omega - here.omega)[:, None]
    plain = (here.omega**2 - found.omega**2 + 2j * here.ratio * here.omega**2)[:, None]
    return np.asarray(found.level * oscillator.load.harmonics[1] - plain * inertia - 1j * off * dashpots)


@by_one_thread
def isolation(others: OtherModes, resonance: Resonance, dof: int) -> Isolation:
    """Return the isolation of a mode at a resonance.

    Parameters
    ----------
    others
        The other modes.
    resonance
        Resonance of the synthesis.
    dof
        The output that counts.
    """
    own = others.oscillator
    found = at_resonance(own, resonance)
    here = own.at(found.place)
    motion = own.displacement(found.place)[0]
    system = own.backbone.system
    gaps = as_array(system.interface.gap_operator)
    rows = np.vstack([np.eye(1, system.structure.n, dof), gaps])
    beside = others.answer(found.omega, left_over(own, found), rows)[0]
    moves = rows @ motion[1]
    distance = others.distance(resonance.omega)
    return Isolation(
        _share(beside[:1], moves[:1]),
        _share(beside[1:], moves[1:]),
        distance,
        abs(float(here.ratio[0])) / distance,
        growth(own, resonance.place),
        _share(motion[2:, dof], motion[1:2, dof]),
        is_linear(own, resonance.place, 1.0 + _share(beside[1:], moves[1:])),
    )


def growth(oscillator: ModalOscillator, place: float) -> float:
    """Return ``d ln a / d ln level`` of the resonance at a position; infinite where two resonances meet."""
    ends = np.clip([place - ACROSS, place + ACROSS], *oscillator.ends)
    level = np.log(oscillator.needed(ends))
    size = np.log(oscillator.at(ends).amplitude)
    change = float(level[1] - level[0])
    return float(size[1] - size[0]) / change if change != 0.0 else np.inf


def is_linear(oscillator: ModalOscillator, place: float, factor: float = 1.0) -> bool:
    """Whether the mode is still linear at `factor` times the amplitude of a position."""
    last = min(place + float(np.log(factor)), oscillator.ends[1])
    looked = np.append(oscillator.place[oscillator.place <= last], last)
    here = oscillator.at(looked)
    moved = np.abs(here.omega / here.omega[0] - 1.0)
    damped = np.abs(here.ratio - here.ratio[0]) / np.maximum(np.abs(here.ratio[0]), CHANGES)
    return bool(oscillator.begins > 0.0 and max(np.max(moved), np.max(damped)) < CHANGES)


@by_one_thread
def with_others(others: OtherModes, found: Synthesised, dofs: IntArray) -> ComplexArray:
    """Return (p, k) first harmonics of dofs with the other modes included, in the phase of the load, m."""
    own = others.oscillator
    motion = own.first(found.place)[:, dofs] * np.exp(1j * found.phase)[:, None]
    rows = np.zeros((dofs.size, own.backbone.system.structure.n))
    rows[np.arange(dofs.size), dofs] = 1.0
    return np.asarray(motion + others.answer(found.omega, left_over(own, found), rows))


@by_one_thread
def peak_with_others(others: OtherModes, curve: Synthesised, found: Resonance, dof: int) -> tuple[float, float]:
    """Return the peak amplitude of a dof with the other modes included, m, and its frequency, rad/s.

    Parameters
    ----------
    others
        The modes beside the followed one.
    curve
        The response of the level.
    found
        One of its peaks.
    dof
        The output.
    """
    own = others.oscillator.at(np.array([found.place]))
    width = WIDTHS * abs(float(own.ratio[0])) * found.omega
    near = np.abs(curve.omega - found.omega) <= width
    top = at_resonance(others.oscillator, found)
    place, omega = np.append(top.place, curve.place[near]), np.append(top.omega, curve.omega[near])
    both = replace(top, place=place, omega=omega, phase=np.append(top.phase, curve.phase[near]))
    size = np.abs(with_others(others, both, np.array([dof]))[:, 0])
    at = int(np.argmax(size))
    return float(size[at]), float(omega[at])


def _share(one: ComplexArray, other: ComplexArray) -> float:
    size = float(np.linalg.norm(other))
    return float(np.linalg.norm(one)) / size if size > 0.0 else np.inf


def _basis(free: Structure, force: ComplexArray) -> Matrix:
    """Return a basis of the relevant motions."""
    if free.n <= WHOLE:
        return np.eye(free.n)
    still = replace(free, stiffness=_hermitian(free.stiffness), mass=_hermitian(free.mass))
    shapes = np.asarray(normal_modes(still, LOWEST).shapes)
    answer = np.linalg.solve(still.stiffness, force)
    both = np.column_stack([shapes, answer / np.linalg.norm(answer)])
    square, turn = np.linalg.eigh(both.conj().T @ (still.mass @ both))
    kept = square > 1e-10 * square[-1]
    return both @ (turn[:, kept] / np.sqrt(square[kept]))


def _hermitian(matrix: Matrix) -> Matrix:
    dense = as_array(matrix)
    return 0.5 * (dense + dense.conj().T)


@dataclass(frozen=True, eq=False)
class Along:
    """Contribution of the other modes along a response, all arrays (p,).

    Parameters
    ----------
    amplitude
        Amplitude of the output in the first harmonic, other modes included, m.
    share
        Motion of the other modes over the followed mode, the larger value of output and contact gaps.
    change
        Approximate relative change of the amplitude, because the other modes move the contacts.
    linear
        Whether nothing slips: then the response is exact.
    """

    amplitude: FloatArray
    share: FloatArray
    change: FloatArray
    linear: BoolArray

    @property
    def alone(self) -> BoolArray:
        """Whether nothing slips, or share and change are at most `ALONE`."""
        return self.linear | ((self.share <= ALONE) & (self.change <= ALONE))


def along(others: OtherModes, found: Synthesised, dof: int) -> Along:
    """Return the contribution of the other modes along a synthesised response.

    Parameters
    ----------
    others
        The modes beside the followed one.
    found
        The response of a level.
    dof
        The output.
    """
    own = others.oscillator
    system = own.backbone.system
    gaps = np.asarray(system.interface.gap_operator @ np.eye(system.structure.n))
    rows = np.vstack([np.eye(1, system.structure.n, dof), gaps])
    moves = (own.first(found.place) * np.exp(1j * found.phase)[:, None]) @ rows.T
    beside = others.answer(found.omega, left_over(own, found), rows)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = [
            np.linalg.norm(beside[:, k], axis=1) / np.linalg.norm(moves[:, k], axis=1)
            for k in (slice(1), slice(1, None))
        ]
    # amplitude of the mode alone that has the gaps of all modes together
    size = np.sum(np.abs(moves[:, 1:]) ** 2, axis=1)
    both = np.abs(1.0 + np.sum(moves[:, 1:].conj() * beside[:, 1:], axis=1) / size)
    felt = _needs(own, found.place + np.log(both), found.omega)
    turned = np.log(felt / _needs(own, found.place, found.omega))
    linear = found.place + np.log1p(share[1]) < slips_from(own)
    return Along(
        np.abs(moves[:, 0] + beside[:, 0]), np.fmax(*share), np.abs(_steepness(own, found) * turned), np.asarray(linear)
    )


def slips_from(oscillator: ModalOscillator) -> float:
    """Return the first position at which the mode differs from the linear one; infinite if it never does."""
    if oscillator.begins <= 0.0:
        return -np.inf
    here = oscillator.at(oscillator.table)
    moved = np.abs(here.omega / here.omega[0] - 1.0)
    damped = np.abs(here.ratio - here.ratio[0]) / np.maximum(np.abs(here.ratio[0]), CHANGES)
    off = np.flatnonzero(np.maximum(moved, damped) >= CHANGES)
    return float(oscillator.table[off[0]]) if off.size else np.inf


def _needs(oscillator: ModalOscillator, place: FloatArray, omega: FloatArray) -> FloatArray:
    """Return the absolute modal dynamic stiffness at positions and frequencies."""
    here = oscillator.at(np.clip(place, *oscillator.ends))
    return np.asarray(np.abs(here.stiffness(omega)))


def _steepness(oscillator: ModalOscillator, found: Synthesised) -> FloatArray:
    """Return ``d ln a / d ln level`` at the frequency of each point."""
    ends = [np.clip(found.place + d, *oscillator.ends) for d in (-DIFFERENCE, DIFFERENCE)]
    here = [oscillator.at(place) for place in ends]
    level = [np.log(np.abs(o.stiffness(found.omega)) * o.amplitude / np.abs(o.force)) for o in here]
    grown = np.log(here[1].amplitude / here[0].amplitude)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(grown / (level[1] - level[0]))
