"""Backbones: frequency and damping ratio of a mode over its amplitude, from full stick on.

The extended periodic motion concept (Krack, Computers & Structures 154 (2015) 59-71) replaces the damping C by ``C - ξ
M``. Then a periodic motion exists at every amplitude, and ``ξ / 2ω`` is its damping ratio without the added term. For a
conservative mode ξ is zero.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.adaptive_continuation import LEAPS, follow
from stickslip.response.continuation.branch import Followed, Route, branch_of
from stickslip.response.nonlinear_modes.closer import LOCATED, Closer
from stickslip.response.nonlinear_modes.harmonic_levels import ModeCurve
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.curve import slip_amplitude
from stickslip.response.self_excited.modes import StuckMode
from stickslip.response.self_excited.problem import Contacts, contacts_of, leaving, self_excited_motions
from stickslip.response.system import System
from stickslip.solve.newton_method import newton
from stickslip.solve.status import Status
from stickslip.units import millimetres, millimetres_between

MEETS, OVER = "internal resonance", "stepped over an internal resonance"
ROUNDED = 1e-9
Concept = Literal["periodic", "decaying"]
BEGINS = 0.5  # first amplitude of a curve, over the amplitude at the onset of slip
ENDS, GROSS = (300.0, 1e5)  # last amplitude over that onset: of a curve, and of a curve to gross slip at the latest
TIMES = 12  # largest number of points over the requested one: lift-off may fold a curve hundreds of times
CLOSER = 30  # least budget of points that refine a curve
LOST = 3  # failed points in a row that end a curve


@dataclass(frozen=True, eq=False)
class ModePoint:
    """Periodic motion of a nonlinear mode.

    Attributes
    ----------
    amplitude
        Amplitude of the followed coordinate in the first harmonic, m.
    omega
        Frequency, rad/s; for a decaying motion ``|λ|``.
    ratio
        Damping ratio ``ξ / 2ω`` of the free decay, linear damping included; for a decaying motion ``-Re λ / |λ|``.
    coefficients
        (H+1, n) displacement of all dofs at that amplitude, m, static term included.
    modal_amplitude
        ``sqrt(X_1^H M X_1)``, kg^0.5 m.
    energy
        Twice the mean kinetic energy of all harmonics, J, on a wheel of one sector. With linear springs this is the
        total energy.
    order
        Highest harmonic.
    status
        How the solver ended; a point that did not converge is no motion.
    slipping
        Share of the contact points that slip or open at some time; a contact with several sliders counts by its share
        of slipping ones.
    open_for
        Share of the period for which a contact point is open, the largest over all points.
    change
        Predicted relative change of frequency or damping ratio with more harmonics, the larger one. On the last level,
        the change from fewer harmonics; NaN with one set of harmonics.
    sticking
        Share of the points that can slip which stick throughout.
    """

    amplitude: float
    omega: float
    ratio: float
    coefficients: ComplexArray
    modal_amplitude: float
    energy: float
    order: int
    status: Status
    slipping: float = np.nan
    open_for: float = np.nan
    change: float = np.nan
    sticking: float = np.nan

    @property
    def converged(self) -> bool:
        """Whether the point is a solution."""
        return self.status.converged


@dataclass(frozen=True, eq=False)
class Backbone:
    """Periodic motions of a nonlinear mode over the amplitude.

    Attributes
    ----------
    system, load
        System and its static load.
    mode
        Linear mode at small amplitudes.
    dof
        The followed coordinate.
    points
        Points in the order of the curve; the amplitude turns back at a fold.
    end
        Reason for the end of the curve, in words.
    resonant
        Harmonic in internal resonance with another mode at each point; 0 without any.
    other_ratio
        Damping ratio by the other concept (see `ModeSweep`) at the amplitude of `largest`; NaN without a motion nearby.
    """

    system: System
    load: HarmonicLoad
    mode: StuckMode
    dof: int
    points: tuple[ModePoint, ...]
    end: str
    resonant: tuple[int, ...] = ()
    other_ratio: float = np.nan

    @property
    def largest(self) -> int | None:
        """Index of the point with the largest damping ratio, internal resonances excluded; None without a solution."""
        return most_damped([p.ratio if p.converged else np.nan for p in self.points], self.resonant)

    @property
    def solutions(self) -> tuple[ModePoint, ...]:
        """Converged points."""
        return tuple(p for p in self.points if p.converged)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeSweep:
    """Amplitudes and harmonics of a nonlinear mode.

    Parameters
    ----------
    span
        First and last amplitude of the coordinate, m, for a motion in the shape of the linear mode. Other motions count
        by their kinetic energy over the square of the frequency. None: from half the amplitude at the onset of slip to
        300 times the onset, or to gross slip. Contacts that never slip or open need a span.
    points
        Smallest number of points.
    most_harmonics
        Highest harmonic. The number of harmonics is raised from h to 2 h + 1 where frequency or damping ratio would
        change by more than `tolerance`. It stays fixed if this is at most the initial number.
    tolerance
        Acceptable relative change of frequency or damping ratio with more harmonics.
    to_gross_slip
        Whether the curve ends at gross slip: every contact that can slip has opened or slipped with all its sliders.
    concept
        ``periodic``: motions sustained by negative damping (Krack 2015); ``decaying``: free decaying motions,
        ``e^{λt}`` and its powers (Laxalde & Thouverez 2009).
    """

    span: tuple[float, float] | None = None
    points: int = 30
    most_harmonics: int = 0
    tolerance: float = 1e-3
    to_gross_slip: bool = False
    concept: Concept = "periodic"

    def require_span(self, interface: Interface, name: str = "ModeSweep.span") -> None:
        """Raise `InputError` if the span, called `name` in the message, is missing and no contact can slip or open."""
        if self.span is None and not np.any(leaving(interface)):
            raise input_error(
                name,
                "is left out, and no contact slips or opens: nothing says where the amplitudes begin and end",
                "Give the lowest and the highest amplitude.",
            )


@dataclass(frozen=True, eq=False)
class ModeWay:
    """Continuation of a nonlinear mode; `mode_way` makes one.

    Parameters
    ----------
    curve, route
        Equations of the motions, and range of the amplitude.
    to_gross_slip
        Whether the mode ends at gross slip.
    """

    curve: ModeCurve
    route: Route
    to_gross_slip: bool

    def follow(self, done: Sequence[Followed] = ()) -> Iterator[Followed]:
        """Yield results until the mode ends or is lost, without those in `done` from an interrupted run."""
        every = [one for one in done if one.kind != "between"]
        for one in self._followed(tuple(every)):
            every.append(one)
            yield one
        between = [one for one in done if one.kind == "between"]
        yield from Closer(self.curve, branch_of(every)).run(max(self.route.points, CLOSER), between)

    def _followed(self, done: Sequence[Followed]) -> Iterator[Followed]:
        """Yield the new points that are not in `done`."""
        branch: list[Followed] = []
        for i, one in enumerate(chain(done, follow(self.curve, self.route, done))):
            if i >= len(done):
                yield one
            if one.kind == "point":
                branch = [*branch[: one.index], one]
            elif one.kind == "found":
                branch[one.index] = one
            else:
                continue
            if self._ends(branch, one):
                return

    def backbone(self, every: Iterable[Followed]) -> Backbone:
        """Return the mode from all results of `follow`."""
        own, found = self.curve.problems[0], branch_of(every)
        made = tuple(mode_point(self.curve, f) for f in found)
        end = _end(made, found[-1], self.route.last, stops=self.to_gross_slip)
        anew = _begun_anew(found, self.route, self.curve.control.first)
        end += f"; taken up again {anew} time{'s' * (anew > 1)} where it led nowhere" if anew else ""
        closer = Closer(self.curve, list(found))
        end += self._resonances(closer, made)
        mode = Backbone(own.system, own.load, own.mode, own.dof, made, end, tuple(closer.resonant()))
        most = mode.largest
        return mode if most is None else replace(mode, other_ratio=self._by_the_other_concept(found[most]))

    def _by_the_other_concept(self, one: Followed) -> float:
        """Return the damping ratio by the other concept at the amplitude of a point; NaN without a motion nearby."""
        other = replace(self.curve, decaying=not self.curve.decaying, wider={})
        problem, own = other.problem(one.level), other.problems[one.level]
        found = newton(lambda y: problem.linearise(y, one.p), one.point.x, own.how.newton)
        return other.frequency_and_damping(one.level, found.x)[1] if found.status.converged else np.nan

    def _resonances(self, closer: Closer, made: Sequence[ModePoint]) -> str:
        """Describe where harmonics of the mode meet other modes that respond or may respond; empty without any."""
        said = []
        for one in closer.crossings():
            ends = (made[one.first].amplitude, made[one.last].amplitude)
            at = f"from {millimetres_between(min(ends), max(ends), 5)}"
            whose = f"mode {one.mode}" if one.same_waves else f"mode {one.mode} of its wave"
            if one.width > LOCATED * (1.0 + ROUNDED):
                said.append(f"{OVER} of harmonic {one.harmonic} with {whose} {at}")
            elif one.takes_part:
                said.append(f"{MEETS} of harmonic {one.harmonic} with {whose} {at}")
        return "".join(f"; {text}" for text in dict.fromkeys(said))

    def _ends(self, branch: Sequence[Followed], one: Followed) -> bool:
        """Whether the latest point ends the mode."""
        lost = len(branch) > LOST and not any(f.converged for f in branch[-LOST:])
        if lost or len(branch) > TIMES * self.route.points:
            return True
        return self.to_gross_slip and one.converged and self.curve.slips_grossly(one)


@by_one_thread
def nonlinear_mode(
    system: System,
    load: HarmonicLoad,
    mode: StuckMode,
    dof: int,
    how: Discretisation | None = None,
    sweep: ModeSweep | None = None,
) -> Backbone:
    """Follow a nonlinear mode over its amplitude.

    Parameters
    ----------
    system
        System with contacts; on a wheel the wave number of the mode is its engine order.
    load
        Static forces.
    mode
        One of `stuck_modes`.
    dof
        Coordinate of the reported amplitude.
    how
        Initial harmonics, samples, solver.
    sweep
        Range of amplitudes and highest harmonic.

    Raises
    ------
    InputError
        If a contact is rigid, a harmonic load acts, the coordinate is at rest in the mode, or the span is missing and
        no contact slips.
    """
    way = mode_way(system, load, mode, dof, how, sweep)
    return way.backbone(tuple(way.follow()))


def mode_way(
    system: System,
    load: HarmonicLoad,
    mode: StuckMode,
    dof: int,
    how: Discretisation | None = None,
    sweep: ModeSweep | None = None,
) -> ModeWay:
    """Set up the continuation of a nonlinear mode over its amplitude; parameters as in `nonlinear_mode`."""
    along = sweep or ModeSweep()
    along.require_span(system.interface)
    problem = self_excited_motions(system, load, mode, dof, how or Discretisation())
    span = along.span
    if span is None:
        slips = slip_amplitude(problem)
        span = (BEGINS * slips, (GROSS if along.to_gross_slip else ENDS) * slips)
    curve = ModeCurve.of(
        problem, span, along.points, along.most_harmonics, along.tolerance, decaying=along.concept == "decaying"
    )
    first, last = (float(np.log(a)) for a in span)
    route = Route(first=first, last=last, points=along.points)
    return ModeWay(curve, route, along.to_gross_slip)


def most_damped(ratio: Sequence[float] | FloatArray, resonant: Sequence[int] | IntArray) -> int | None:
    """Return the index of the largest damping ratio; None without a solution.

    Points in internal resonance count only if there are no others.

    Parameters
    ----------
    ratio
        Damping ratio of each point, NaN without a solution.
    resonant
        Harmonic in internal resonance at each point, 0 without any; may be empty.
    """
    values = np.asarray(ratio, dtype=float)
    alone = np.where(np.asarray(resonant) > 0, np.nan, values) if len(resonant) else values
    for each in (alone, values):
        if np.any(np.isfinite(each)):
            return int(np.nanargmax(each))
    return None


def mode_point(curve: ModeCurve, found: Followed) -> ModePoint:
    """Return a point of the curve as a `ModePoint`."""
    problem, y = curve.problems[found.level], found.point.x
    scale = float(np.exp(found.p))
    order = problem.balance.order
    omega, ratio = curve.frequency_and_damping(found.level, y)
    full = curve.linear(found.level, y).recover(problem.omega(y), scale * problem.relative(y))
    energies = [_product(problem.system, h, full[h]) for h in range(1, order + 1)]
    squares = (omega * np.arange(1, order + 1)) ** 2
    contacts = contacts_of(problem, y, scale) if found.converged else Contacts(np.nan, np.nan, np.nan)
    return ModePoint(
        float(abs(full[1, problem.dof])),
        omega,
        ratio,
        full,
        float(np.sqrt(energies[0])),
        0.5 * float(squares @ np.array(energies)),
        order,
        found.point.solution.status,
        contacts.slipping,
        contacts.open_for,
        found.judged.bound,
        contacts.sticking,
    )


def _product(system: System, harmonic: int, moving: ComplexArray) -> float:
    """Return ``X^H M X`` of a harmonic."""
    return float(np.vdot(moving, system.structure.of_harmonic(harmonic).mass @ moving).real)


def _begun_anew(found: Sequence[Followed], route: Route, first: float) -> int:
    """Count the restarts beyond a lost branch.

    A restart lies a known share of the longest step ahead of all other points and continues with the first step length.
    """
    count, farthest = 0, found[0].p
    for f in found[1:]:
        ahead = (f.p - farthest) / route.gap
        leapt = f.p == route.last or any(abs(ahead - share) < 1e-9 for share in LEAPS)
        count += f.converged and leapt and f.point.step == first
        farthest = max(farthest, f.p)
    return count


def _end(points: Sequence[ModePoint], found: Followed, last: float, *, stops: bool) -> str:
    """Describe the end of a curve whose last point is `found`."""
    solved = [p for p in points if p.converged]
    if not solved:
        return "no motion found at the first amplitude"
    end = solved[-1]
    slips = next((p.amplitude for p in solved if p.slipping == 1.0), None)
    if points[-1] is end and (found.p == last or (stops and end.slipping == 1.0)):
        if found.p != last:
            return f"gross slip at {millimetres(end.amplitude)}"
        if slips is None and end.sticking == 0.0:
            return f"amplitude reached, no contact sticks at {millimetres(end.amplitude)}; contacts that do not slip stay open"
        return f"amplitude reached{'' if slips is None else f', gross slip from {millimetres(slips)} on'}"
    told = f"{millimetres(end.amplitude)} after {len(points)} points"
    if end.open_for > 0.0:
        opened = f"contacts open for up to {100 * end.open_for:.0f} % of the period"
        return f"lift-off ends it at {told}: {opened}"
    return f"lost at {told}"
