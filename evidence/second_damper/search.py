"""The search for a second damper, for the second bending mode of the example's blades: ``python -m evidence.second_damper``.

Gastaldi & Berruti (2017, sections 5.4 and 7) tell of their second damper what it does, not how it is made: its flat side never slips,
some points slip below F_CL/F_HE = 30, all stick above 230, and one harmonic is enough at 23.4 and 11.7. Here angles and contact
lines that do so are looked for. The blades, their damping and the place of the force are those of `examples/two_blades`.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from time import process_time
from typing import Any

import numpy as np

from evidence.models.two_blades import COARSER, SHIPPED, TwoBlades, two_blades
from stickslip import forced_response
from stickslip.contact.law import OPEN, SLIP
from stickslip.errors import StickslipError
from stickslip.model.rigid.dampers import FlatCurvedDamper, section_moments
from stickslip.response import accepted_points, forced_problem, signals
from stickslip.units import HZ

LENGTH, STEEL = 0.046, 7850.0  # m of the damper along the axis, kg/m³
RANGE = (450.0, 680.0)  # Hz, around the second bending of the free and of the stuck blades
STUCK, ONSET, PUBLISHED = 240.0, 29.0, (23.4, 11.7)
JUDGED = (*PUBLISHED, 5.0)  # where the paper's figures are, and lower than its rig goes
LOWEST = 2.0  # told, not asked for
RATIOS = (STUCK, ONSET, *JUDGED, LOWEST)
LINES = "L1", "L2", "R"
BALANCED = 0.4  # smallest share that one of L1 and L2 must carry of what the other does
CLOSED = 0.95  # share of the time that they must be closed
ALIKE = 0.05  # difference of peaks with one and with five harmonics
FLAT_ANGLES, CURVED_ANGLES = (38.0, 44.0, 50.0, 56.0), (66.0, 72.0, 78.0)
DISTANCES = (0.002, 0.025), (0.005, 0.02)
OTHERS = ({"damping.ratio": 0.003}, {"damping.ratio": 0.012}, {"part.blades.force_span": 0.4})
FILLINGS = (0.5, 1.5)
SHARES = None, 0.1  # of the friction that holds while the damper seats itself; None: no seating
ASKED = 7  # what is asked of a damper


@dataclass(frozen=True)
class Candidate:
    """A damper: angles of both sides, contact lines, and how it was seated.

    Attributes
    ----------
    flat_deg, curved_deg
        Angles of the sides.
    flat
        Distances of L1 and L2 from the apex, m.
    share
        Of the friction with which the static state is found (`forced_response.static_friction_share`); None: not found first.
    filling
        Mass over that of a full section of steel.
    more
        Other keys of the study.
    """

    flat_deg: float
    curved_deg: float
    flat: tuple[float, float]
    share: float | None = None
    filling: float = 1.0
    more: tuple[tuple[str, Any], ...] = ()

    @cached_property
    def right(self) -> float:
        """Distance of R from the apex, m: without friction the pull would press L1 and L2 alike."""
        places = np.arange(0.003, 0.03, 0.0005)
        return float(places[np.argmin([abs(self._off_middle(float(r))) for r in places])])

    def _off_middle(self, right: float) -> float:
        """Return how far from the middle of L1 and L2 the flat side is pressed, m: pull, R and the flat side meet in a point."""
        f, c = math.radians(self.flat_deg), math.radians(self.curved_deg)
        normal = np.array([math.sin(c), math.cos(c)])
        at = right * np.array([math.cos(c), -math.sin(c)])
        centre = section_moments(self._damper(right).outline())[1]
        meeting = at - (at[0] - centre[0]) / normal[0] * normal
        return float(-(meeting @ [math.cos(f), math.sin(f)]) - np.mean(self.flat))

    def _damper(self, right: float) -> FlatCurvedDamper:
        f, c = math.radians(self.flat_deg), math.radians(self.curved_deg)
        return FlatCurvedDamper(
            apex=(0.0, 0.0), flat_angle=f, curved_angle=c, flat_distances=self.flat, curved_distance=right
        )

    @property
    def values(self) -> dict[str, Any]:
        """Keys of the study."""
        area, centre, second = section_moments(self._damper(self.right).outline())
        mass = self.filling * STEEL * LENGTH * area
        x, z = second[:2]
        about = mass * np.array([z + LENGTH**2 / 12, x + z, x + LENGTH**2 / 12])
        own = {
            "part.blades.flat_angle_deg": self.flat_deg,
            "part.blades.curved_angle_deg": self.curved_deg,
            "part.damper.flat_distances_m": self.flat,
            "part.damper.curved_distance_m": _rounded(self.right),
            "part.damper.mass_kg": _rounded(mass),
            "part.damper.inertia_kg_m2": tuple(_rounded(float(v)) for v in about),
            "part.damper.centre_m": (_rounded(centre[0]), 0.0, _rounded(centre[1])),
            "forced_response.frequency_hz": RANGE,
            "forced_response.points": 24,
        }
        seated = {"forced_response.static_friction_share": self.share} if self.share is not None else {}
        return own | seated | dict(self.more)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


@dataclass(frozen=True)
class AtPeak:
    """What a damper does at the peak of a response.

    Attributes
    ----------
    size
        Amplitude of the output over the force, m/N.
    slips, opens
        Of L1, L2 and R: the largest share of a period that a point of the line slips, and is open.
    lost
        Number of frequencies that were not found.
    """

    ratio: float
    size: float
    hertz: float
    slips: tuple[float, ...]
    opens: tuple[float, ...]
    lost: int

    @property
    def glued(self) -> bool:
        """Whether the flat side does not slip."""
        return max(self.slips[:2]) == 0.0

    @property
    def stuck(self) -> bool:
        """Whether nothing slips or opens."""
        return max(*self.slips, *self.opens) == 0.0


@dataclass(frozen=True)
class Found:
    """A candidate and what it does.

    Attributes
    ----------
    static
        Normal forces of L1, L2 and R under the pull alone, N.
    few, many
        At the peaks of the ratios with one and with five harmonics; the latter of candidates that are worth it.
    alarms
        Largest error that the Jacobian Alert predicts along the responses at the published ratios, of those that show all else.
    """

    candidate: Candidate
    static: tuple[float, ...]
    few: dict[float, AtPeak]
    many: dict[float, AtPeak]
    alarms: dict[float, float] = field(default_factory=dict)

    def holds(self) -> dict[str, bool]:
        """Return what is asked of the damper, and whether it is so."""
        slipping = [self.few[r] for r in (ONSET, *JUDGED)]
        loaded = min(self.static[:2]) >= BALANCED * max(self.static[:2])
        closed = max(max(p.opens[:2]) for p in slipping) <= 1 - CLOSED
        return {
            "L1 and L2 share the pull": loaded,
            "L1 and L2 stay closed": closed,
            "the flat side does not slip": all(p.glued for p in slipping),
            "R slips below 30": all(p.slips[2] > 0.0 for p in slipping),
            "all stick above 230": self.few[STUCK].stuck,
            "one harmonic is enough": bool(self.many) and max(map(self.off, JUDGED)) <= ALIKE,
            "the alert never asks": bool(self.alarms) and max(self.alarms.values()) <= ALIKE,
        }

    @property
    def score(self) -> int:
        """How much of that is so."""
        return sum(self.holds().values())

    def off(self, ratio: float) -> float:
        """Return the difference of the peaks with one and with five harmonics, a fraction."""
        return abs(self.few[ratio].size / self.many[ratio].size - 1)

    def of_stuck(self, ratio: float) -> float:
        """Return the peak over the force, over that in full stick."""
        best = self.many.get(ratio) or self.few[ratio]
        return best.size / self.few[STUCK].size


def judged(candidate: Candidate) -> Found | None:
    """Follow the responses of a damper; None if its lines do not lie on the platforms, or nothing holds it."""
    try:
        blades = two_blades(COARSER, SHIPPED, **candidate.values)
        forces = np.abs(blades.question.model.static_force[:, 2])
        static = tuple(float(forces[k].sum()) for k in _of_lines(blades))
        few = {r: at_peak(blades, r, "always_low") for r in RATIOS}
        found = Found(candidate, static, few, {})
        if found.score < 4:
            return found
        many = {r: at_peak(blades, r, "always_high") for r in (*JUDGED, LOWEST)}
        found = Found(candidate, static, few, many)
        return found if found.score < ASKED - 1 else replace(found, alarms=alarms(blades))
    except StickslipError:
        return None


def alarms(blades: TwoBlades) -> dict[float, float]:
    """Return the largest error that the Jacobian Alert predicts along the responses with one harmonic at the published ratios."""
    found = {}
    for ratio in PUBLISHED:
        question = blades.at(ratio)
        sweep = replace(question.sweep, selection="jacobian_alert")
        points = forced_response(blades.system, question.model.load, sweep)
        found[ratio] = max(p.predicted_error for p in points if p.stage == "low" and p.converged)
    return found


def _of_lines(blades: TwoBlades) -> list[list[int]]:
    names = blades.system.interface.names
    return [[i for i, n in enumerate(names) if n.split(".")[0] == line] for line in LINES]


def at_peak(blades: TwoBlades, ratio: float, selection: str) -> AtPeak:
    """Follow a response with one (``always_low``) or five harmonics, and look at the contacts at its peak."""
    question = blades.at(ratio)
    sweep = replace(question.sweep, selection=selection)
    problem = forced_problem(blades.system, question.model.load, sweep)
    points = accepted_points(tuple(forced_response(blades.system, question.model.load, sweep)))
    good = [p for p in points if p.converged]
    top = max(good, key=problem.amplitude)
    state = signals(problem, top).state
    slips = np.mean(np.any(state == SLIP, axis=1), axis=1)
    opens = np.mean(np.all(state == OPEN, axis=1), axis=1)
    lines = _of_lines(blades)
    return AtPeak(
        ratio,
        problem.amplitude(top) / question.model.excitation,
        float(top.omega / HZ),
        tuple(float(slips[k].max()) for k in lines),
        tuple(float(opens[k].max()) for k in lines),
        len(points) - len(good),
    )


def first_stage() -> list[Candidate]:
    """Return dampers of all angles and lines, each seated and not."""
    return [
        Candidate(f, c, flat, share) for f, c, flat, share in product(FLAT_ANGLES, CURVED_ANGLES, DISTANCES, SHARES)
    ]


def second_stage(best: Candidate) -> list[Candidate]:
    """Return a damper with other damping, place of the force and mass."""
    changed = [replace(best, more=tuple(keys.items())) for keys in OTHERS]
    return changed + [replace(best, filling=filling) for filling in FILLINGS]


def searched(candidates: Iterable[Candidate]) -> tuple[list[Found], int]:
    """Return what was found, the best first, and how many candidates could not be built or held."""
    found, none = [], 0
    for candidate in candidates:
        one = judged(candidate)
        if one is None:
            none += 1
            print(f"{process_time():6.0f} s  {named(candidate)}: none", flush=True)
            continue
        print(f"{process_time():6.0f} s  {named(candidate)}: {one.score} of {ASKED}", flush=True)
        found.append(one)
    return sorted(found, key=_rank, reverse=True), none


def _rank(found: Found) -> tuple[int, float, float]:
    """Most of what is asked for; then the quietest alert; then least difference of one from five harmonics."""
    alarm = max(found.alarms.values(), default=np.inf)
    off = max(map(found.off, JUDGED)) if found.many else np.inf
    return found.score, -alarm, -off


def named(candidate: Candidate) -> str:
    more = ", ".join(f"{k.split('.')[-1]} = {v}" for k, v in candidate.more)
    filling = f"mass × {candidate.filling:g}" if candidate.filling != 1 else ""
    seated = "seated" if candidate.share is not None else ""
    lines = "/".join(f"{1e3 * v:g}" for v in (*candidate.flat, candidate.right))
    own = f"{candidate.flat_deg:g}°/{candidate.curved_deg:g}°, {lines} mm"
    return ", ".join(filter(None, (own, seated, more, filling)))
