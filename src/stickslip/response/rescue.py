"""What is tried where a frequency does not converge: another globalisation, and last a homotopy in the excitation."""

from dataclasses import dataclass, replace

from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.condensed_product import at_frequency
from stickslip.response.sweep import ForcedProblem
from stickslip.solve.continuation import Following, Point, StepControl, start_point, trace
from stickslip.solve.newton import Solution, newton
from stickslip.solve.status import Rung, Status

FAINT = (
    1e-3,
    1e-5,
)  # shares of the excitation at which contacts hardly change: the problem is linear there
GROWING = StepControl(scale=1.0, first=0.1, largest=0.5, smallest=1e-4, max_points=120)
PATIENCE = 60  # iterations of a corrector that has no neighbour to start from
OTHERS = ("dogleg", "levenberg_marquardt")  # in this order


@dataclass(frozen=True, eq=False)
class GrowingLoad:
    """The balance at one frequency under a share p of its excitation; the static load is always whole."""

    balance: HarmonicBalance
    omega: float
    excitation: FloatArray  # (size,) scaled

    def linearise(self, x: FloatArray, p: float) -> Linearisation:
        """Return residual and derivatives at the scaled unknowns `x` and the share `p`."""
        at = self.balance.linearise(x, self.omega)
        left = (1.0 - p) * self.excitation
        return replace(at, residual=at.residual + left, jac_p=-self.excitation)


def growing_load(balance: HarmonicBalance, omega: float) -> GrowingLoad:
    """Return the homotopy in the excitation at the frequency `omega` (rad/s)."""
    load = at_frequency(balance.linear, omega, balance.order).load.copy()
    load[0] = 0.0
    return GrowingLoad(balance, omega, load.reshape(-1) / balance.force_scale)


def otherwise(
    problem: ForcedProblem, balance: HarmonicBalance, omega: float, guess: FloatArray
) -> Solution:
    """Solve by the other globalisations, one after the other.

    Parameters
    ----------
    problem
        The forced response.
    balance
        Its problem with few or with many harmonics.
    omega
        Frequency, rad/s.
    guess
        (size,) scaled unknowns to start from.

    Returns
    -------
    Solution
        Of the first one that converged, or of the last.
    """
    spent: list[Solution] = []
    for name in OTHERS:
        options = replace(problem.sweep.newton, globalisation=name, max_iterations=PATIENCE)  # type: ignore[arg-type]
        spent.append(newton(lambda x: balance.linearise(x, omega), guess, options))
        if spent[-1].status.converged:
            break
    return replace(charged(spent), rung=Rung.OTHER_GLOBALISATION)


def by_homotopy(
    problem: ForcedProblem, balance: HarmonicBalance, omega: float, static: FloatArray
) -> Solution:
    """Let the excitation grow from next to nothing, by arc length, at a fixed frequency.

    Under a faint excitation nothing changes its state and the problem is linear; damping bounds the motion, so that the branch from there
    comes to the whole excitation. Where several motions stand beside each other it may find another one than its neighbours.

    Parameters
    ----------
    problem
        The forced response.
    balance
        Its problem with few or with many harmonics.
    omega
        Frequency, rad/s.
    static
        (size,) scaled unknowns of the static equilibrium, no vibration.
    """
    growing = growing_load(balance, omega)
    following = replace(problem.following(balance), control=GROWING)
    spent: list[Solution] = []
    for share in FAINT:
        last = _grown(growing, start_point(growing, static, share, following), following, spent)
        if last.p == 1.0 and last.solution.status.converged:
            break
        failed = last.solution.status
        status = Status.TOO_MANY_ITERATIONS if failed.converged else failed
        spent[-1] = replace(spent[-1], status=status)
    return replace(charged(spent), rung=Rung.HOMOTOPY)


def _grown(
    growing: GrowingLoad, start: Point, following: Following, spent: list[Solution]
) -> Point:
    """Follow the branch from `start` until the load is whole, no step converges, or it comes back to where it began."""
    point = start
    spent.append(start.solution)
    if not start.solution.status.converged:
        return start
    for point in trace(growing, start, 1.0, following):
        spent.append(point.solution)
        if point.p < 0.5 * start.p:
            break
    return point


def charged(spent: list[Solution]) -> Solution:
    """Return the last of several solutions, charged with what all of them cost."""
    return replace(
        spent[-1],
        iterations=sum(s.iterations for s in spent),
        seconds_contact=sum(s.seconds_contact for s in spent),
        seconds_linear=sum(s.seconds_linear for s in spent),
    )
