"""The physics of what is tried where a frequency does not converge: homotopies in the excitation and in the friction."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from stickslip.arrays import FloatArray
from stickslip.contact.law import ContactLaw
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.local import AnyBalance
from stickslip.solve.rescue import ByDifference, Evaluate, Homotopy

# shares of the excitation at which contacts hardly change: the problem is linear there
FAINT = (1e-3, 1e-5)
BACK = 1e-3  # share of the faintest load at which a path has come back to rest
STICKY = 30.0  # factor of the friction coefficients at which little slips


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
        return replace(at, residual=at.residual + left, by_omega=-self.excitation)


def growing_load(balance: HarmonicBalance, omega: float) -> GrowingLoad:
    """Return the homotopy in the excitation at the frequency `omega` (rad/s)."""
    load = balance.linear_load(omega).copy()
    load[0] = 0.0
    return GrowingLoad(balance, omega, load.reshape(-1) / balance.force_scale)


def with_friction(balance: HarmonicBalance, factor: float) -> HarmonicBalance:
    """Return the same problem with all friction coefficients times `factor`; laws without one stay as they are."""
    interface = balance.interface
    laws = tuple(_with_friction(law, factor) for law in interface.laws)
    changed = replace(interface, laws=laws)
    compiled = changed.compiled(balance.compiled.evaluator)
    return replace(balance, interface=changed, compiled=compiled)


def _with_friction(law: ContactLaw, factor: float) -> ContactLaw:
    if not hasattr(law, "mu"):
        return law
    with_mu: Any = law  # the protocol of laws knows no friction coefficient
    changed: ContactLaw = replace(with_mu, mu=factor * with_mu.mu)
    return changed


def homotopies(balance: AnyBalance, omega: float, static: FloatArray) -> Iterator[Homotopy]:
    """Yield ways from an easy problem to the balance at one frequency.

    First the excitation grows from next to nothing: there nothing changes its state and the problem is linear. As damping bounds the
    motion under every share of the excitation, the path that begins there comes to the whole of it, through folds if need be (degree
    theory; Allgower & Georg 1990). Where several motions stand beside each other it may find another one than the neighbours in
    frequency. Then the same with much friction, which is let down afterwards.

    Parameters
    ----------
    balance
        The periodic problem.
    omega
        Frequency, rad/s.
    static
        (n_retained,) static equilibrium, m.
    """
    if not isinstance(
        balance, HarmonicBalance
    ):  # of rigid contacts not linear in the excitation, or not all of the equations
        return
    at_rest = balance.unknowns(static[None].astype(complex))
    yield Homotopy((growing_load(balance, omega),), at_rest, FAINT, BACK * FAINT[-1])
    if not any(hasattr(law, "mu") for law in balance.interface.laws):
        return

    def sliding(s: float) -> Evaluate:
        now = with_friction(balance, STICKY ** (1.0 - s))
        return lambda x: now.linearise(x, omega)

    sticky = growing_load(with_friction(balance, STICKY), omega)
    yield Homotopy((sticky, ByDifference(sliding)), at_rest, FAINT, BACK * FAINT[-1])
