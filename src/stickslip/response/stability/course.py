"""Points in the order of the branch, with cheap indicators of a change of stability.

They are folds, the sign of the determinant, and contact transitions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import to_real
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.flow_map.contact_states import ContactStates, is_located, located_part, located_states
from stickslip.solve.linear import factors_of

MOST_ROWS = 500  # largest Jacobian that is factorised only for its sign


@dataclass(frozen=True, eq=False)
class Course:
    """Converged points of a response along its branch.

    Parameters
    ----------
    order
        (n,) positions of the points in the response.
    sign
        (n,) sign of the determinant of the balance's Jacobian, NaN where unknown. It is the parity of the number of
        real multipliers above 1, up to one sign for the whole branch.
    cycle
        (n,) transitions of each point; see `cycle_of`.
    fold
        (n - 1,) whether the branch folds between two neighbours, or close to one of them.
    cut
        (n - 1,) whether the branch is interrupted between two neighbours, by a missing point or a jump of the response.
    """

    order: tuple[int, ...]
    sign: FloatArray
    cycle: tuple[bytes | None, ...]
    fold: BoolArray
    cut: BoolArray

    def like(self, a: int, b: int) -> bool:
        """Whether all points from a to b have the same sign and transitions, without a fold.

        Then equal verdicts at both ends hold between.
        """
        a, b = min(a, b), max(a, b)
        signs, cycles = self.sign[a : b + 1], set(self.cycle[a : b + 1])
        one = bool(np.all(signs == signs[0])) and len(cycles) == 1 and None not in cycles
        return one and not np.any(self.fold[a:b] | self.cut[a:b])

    @property
    def changes(self) -> BoolArray:
        """(n - 1,) whether the list of transitions changes between neighbours."""
        return np.array([a != b or a is None for a, b in pairwise(self.cycle)], dtype=bool)

    @property
    def turns(self) -> BoolArray:
        """(n - 1,) whether the sign of the determinant changes between neighbours."""
        return np.asarray(self.sign[1:] * self.sign[:-1] < 0.0)

    def runs(self) -> Iterator[range]:
        """Yield the uninterrupted ranges of the branch."""
        ends = [0, *(np.flatnonzero(self.cut) + 1).tolist(), len(self.order)]
        yield from (range(a, b) for a, b in pairwise(ends) if a < b)


def course_of(problem: ForcedProblem, points: Sequence[ForcedPoint], along: int, jumps: Sequence[int]) -> Course:
    """Return the course of a response.

    Parameters
    ----------
    problem
        The solved problem.
    points
        The accepted points. Points from `along` on resolve the peak; they are inserted at the nearest position of the
        branch.
    along
        Number of points in the order of the branch.
    jumps
        Positions of the points after which the response jumps.
    """
    branch = [i for i in range(along) if points[i].converged]
    others = [i for i in range(along, len(points)) if points[i].converged]
    if len(branch) < 2:  # no steps to insert points in
        branch, others = sorted([*branch, *others], key=lambda i: points[i].omega), []
    steps = np.diff([points[i].omega for i in branch])
    back = steps[1:] * steps[:-1] < 0.0
    turned = np.zeros(max(len(branch) - 1, 0), dtype=bool)
    turned[1:] |= back
    turned[:-1] |= back
    lost = [b > a + 1 or a in jumps for a, b in pairwise(branch)]
    order, fold, cut = [branch[0]] if branch else [], [], []
    inside = _inserted(points, branch, others)
    for k, following in enumerate(branch[1:]):
        own = [*inside.get(k, []), following]
        order += own
        fold += [bool(turned[k])] * len(own)
        cut += [bool(lost[k])] * len(own)
    chosen = [points[i] for i in order]
    sign = np.array([sign_of(problem, p) for p in chosen], dtype=float)
    folds = np.array(fold, dtype=bool) | (sign[1:] * sign[:-1] < 0.0)
    return Course(tuple(order), sign, tuple(cycle_of(problem, p) for p in chosen), folds, np.array(cut, dtype=bool))


def sign_of(problem: ForcedProblem, point: ForcedPoint) -> float:
    """Return the sign of the determinant of the balance's Jacobian at a solution; NaN if unknown.

    On a branch it follows from the tangent and the sign of the continuation's bordered determinant (Cramer's rule).
    Elsewhere a small Jacobian is factorised.
    """
    if point.tangent.size and point.orientation:
        return float(np.sign(point.tangent[-1]) * point.orientation) or np.nan
    balance = problem.local(point.support, point.by_dof)
    if isinstance(balance, HarmonicBalance) and point.unknowns <= MOST_ROWS:
        jac = balance.linearise(balance.unknowns(point.coefficients), point.omega).jac
        factors = factors_of(jac)
        return np.nan if factors is None else float(factors.sign)
    return np.nan


def _inserted(points: Sequence[ForcedPoint], branch: Sequence[int], others: Sequence[int]) -> dict[int, list[int]]:
    """Assign additional points to the steps of a branch, each where it lengthens the branch least."""
    if not others:
        return {}
    rows = _scaled([points[i] for i in (*branch, *others)])
    own, rest = rows[: len(branch)], rows[len(branch) :]
    lengths = np.linalg.norm(np.diff(own, axis=0), axis=1)
    found: dict[int, list[tuple[float, int]]] = {}
    for i, row in zip(others, rest, strict=True):
        apart = np.linalg.norm(own - row, axis=1)
        k = int(np.argmin(apart[:-1] + apart[1:] - lengths))
        found.setdefault(k, []).append((float(apart[k]), i))
    return {k: [i for _, i in sorted(pairs)] for k, pairs in found.items()}


def _scaled(points: Sequence[ForcedPoint]) -> FloatArray:
    """Return frequency and motion of points as rows of dimensionless numbers."""
    order = max(len(p.coefficients) for p in points)
    motions = np.zeros((len(points), order, points[0].coefficients.shape[1]), dtype=complex)
    for row, p in zip(motions, points, strict=True):
        row[: len(p.coefficients)] = p.coefficients
    flat = motions.reshape(len(points), -1)
    size = max(float(np.abs(flat).max()), np.finfo(float).tiny)
    omega = np.array([p.omega for p in points])
    wide = max(float(np.ptp(omega)), np.finfo(float).tiny)
    return np.hstack([(omega / wide)[:, None], flat.real / size, flat.imag / size])


def cycle_of(problem: ForcedProblem, point: ForcedPoint) -> bytes | None:
    """Return a key of the transitions in the cycle of each contact; None where they are unknown.

    The order of transitions of different contacts does not matter, since no multiplier jumps where it changes. For laws
    without located transitions, the states at the samples count.
    """
    balance = problem.balance(point.support)
    if not isinstance(balance, HarmonicBalance):
        return None
    interface = balance.interface
    gaps = to_real(point.coefficients @ interface.gap_operator.T)
    located = [located_part(law) is not None for law in interface.laws]
    parts: list[bytes] = []
    if any(located):
        states = located_states(interface, gaps)
        if states is None:
            return None
        parts += [_located(states, c) for c, there in enumerate(located) if there]
    sampled = [c for c, law in enumerate(interface.laws) if not is_located(law)]
    if sampled:
        period = contact_forces(gaps, balance.compiled, problem.sweep.samples, point.omega)
        parts += [_cycle(period.state[c].T.astype(float)) for c in sampled]
    return b"|".join(parts)


def has_transitions(cycle: bytes) -> bool:
    """Whether any contact changes its state in a cycle."""
    return any(part.partition(b":")[0] != b"1" for part in cycle.split(b"|"))


def _located(states: ContactStates, contact: int) -> bytes:
    own = states.rows // 3 == contact
    stiffness = states.stiffness[:, contact].reshape(len(states.stiffness), -1)
    return _cycle(np.hstack([np.sign(stiffness), states.sticks[:, own]]))


def _cycle(rows: FloatArray) -> bytes:
    """Return the number of distinct successive rows (n, k) of a cycle, and these rows.

    They do not depend on where the cycle begins.
    """
    changed = np.any(rows != np.roll(rows, 1, axis=0), axis=1)
    chosen = rows[changed] if np.any(changed) else rows[:1]
    # a contact changes at few of the times at which any contact changes
    kept = [b"".join(b"%d" % v for v in row) for row in chosen.astype(np.int64).tolist()]
    turned = min(kept[i:] + kept[:i] for i in range(len(kept)))
    return b"%d:" % len(kept) + b",".join(turned)
