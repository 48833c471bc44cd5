"""Static equilibrium of a rigid damper on its flanks: normal forces, T/N, and whether a flank can slip.

Under its pull a damper is in equilibrium with many combinations of friction forces. A linear program gives the largest
T/N of a flank among them: forces within the friction cones of all points balance the pull, and the friction along the
flank is maximised. If this T/N is below the friction coefficient, the flank cannot slip, for any motion of the blades
(C. Gastaldi, T. M. Berruti, International Journal of Non-Linear Mechanics 92 (2017) 25-40, section 7: platform angles
which do not allow the flat side to slip). The inertia of the damper is neglected.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize

from stickslip.arrays import BoolArray, FloatArray
from stickslip.response.system import System

CONE_RAYS = 8  # rays of a friction cone, four of them along t and w
NO_SLIP = 0.999  # share of the friction coefficient below which a flank does not slip
ANGLES_DEG = np.arange(3.0, 88.0, 6.0)  # inclinations of a flank: small if perpendicular to the pull, large along it
ANGLE_TOLERANCE_DEG = 0.25  # of the ends of a range of angles
FLAT = 0.05  # largest angle between the normals of a plane flank, rad


@dataclass(frozen=True, eq=False)
class Flank:
    """Contact points between a damper and one platform.

    Attributes
    ----------
    name
        Name of the contact.
    directions
        (p, 3, 3) unit vectors t, w, n of each point; the damper presses along minus n.
    points
        (p, 3) positions relative to the centre of mass, m.
    force
        (p, 3) forces of the damper on the platform at rest along t, w, n, N.
    mu
        (p,) friction coefficients.
    """

    name: str
    directions: FloatArray
    points: FloatArray
    force: FloatArray
    mu: FloatArray

    @property
    def normal(self) -> float:
        """Normal force of all points at rest, N."""
        return float(-self.force[:, 2].sum())

    @property
    def friction(self) -> float:
        """Friction limit of all points at rest over their normal force."""
        pressed = np.maximum(-self.force[:, 2], 0.0)
        return float(np.average(self.mu, weights=pressed)) if pressed.any() else float(self.mu.mean())

    @property
    def wrench(self) -> FloatArray:
        """(6,) force (N) and moment about the centre of mass (N m) on the platform at rest."""
        return np.asarray(np.einsum("pkc,pk->c", self.wrenches, self.force))

    @property
    def wrenches(self) -> FloatArray:
        """(p, 3, 6) force and moment of unit forces along t, w, n."""
        moments = np.cross(self.points[:, None, :], self.directions)
        return np.concatenate([self.directions, moments], axis=2)

    @property
    def flat(self) -> bool:
        """Whether the normals of all points are parallel."""
        normals = self.directions[:, 2]
        return bool(np.linalg.norm(normals - normals.mean(axis=0), axis=1).max() < FLAT)

    def turned(self, angle: float, axis: FloatArray) -> "Flank":
        """Return the flank turned by an angle, rad, about an axis (3,) through the mean of its points."""
        c, s = np.cos(angle), np.sin(angle)
        cross = np.cross(np.eye(3), axis)
        turn = c * np.eye(3) + s * cross + (1.0 - c) * np.outer(axis, axis)
        middle = self.points.mean(axis=0)
        return replace(self, directions=self.directions @ turn.T, points=middle + (self.points - middle) @ turn.T)


@dataclass(frozen=True, eq=False)
class FlankLimits:
    """Limits of the friction on a flank.

    Attributes
    ----------
    flank
        The flank at rest.
    most
        Largest T/N in both senses along t, in static equilibrium.
    angle_deg
        Inclination of the flank, degrees: 0 perpendicular to the pull, 90 along the pull; NaN for a flank that is no
        plane.
    held_deg
        Ranges of this angle in which the flank cannot slip to and fro, with the other flanks unchanged.
    """

    flank: Flank
    most: tuple[float, float]
    angle_deg: float
    held_deg: tuple[tuple[float, float], ...]

    @property
    def slips(self) -> bool:
        """Whether the flank can slip to and fro."""
        return min(self.most) >= NO_SLIP * self.flank.friction


@dataclass(frozen=True, eq=False)
class DamperStatics:
    """Statics of a rigid damper.

    Attributes
    ----------
    name
        Name of the part.
    pull
        Resultant of all forces except contact forces, N.
    flanks
        Flanks of the damper.
    """

    name: str
    pull: float
    flanks: tuple[FlankLimits, ...]


def flanks_of(system: System, groups: tuple[str, ...], static_force: FloatArray) -> dict[str, tuple[Flank, ...]]:
    """Return the flanks of each free rigid body, formed by contacts with a friction coefficient.

    Parameters
    ----------
    system
        System; its free bodies have six coordinates each.
    groups
        Name of the contact of each point.
    static_force
        (p, 3) contact forces at rest along t, w, n, N.
    """
    if system.free is None or not system.interface.n_contacts:
        return {}
    gap, table = system.interface.gap_operator, system.structure.dofs
    found = {}
    for part in dict.fromkeys(table.part[i] for i in system.free):
        own = np.array([i for i in system.free if table.part[i] == part])
        components = [table.component[i] for i in own]
        if components != ["x", "y", "z", "rx", "ry", "rz"]:
            continue
        found[part] = tuple(_flanks(system, np.real(gap[:, own].toarray()).reshape(-1, 3, 6), groups, static_force))
    return {part: flanks for part, flanks in found.items() if len(flanks) > 1}


def _flanks(system: System, rows: FloatArray, groups: tuple[str, ...], static_force: FloatArray) -> list[Flank]:
    mu = np.array([getattr(law, "mu", np.nan) for law in system.interface.laws])
    touched = np.abs(rows[:, :, :3]).sum(axis=(1, 2)) > 0.0
    flanks = []
    for name in dict.fromkeys(groups):
        at = touched & np.array([g == name for g in groups])
        if not at.any() or not np.all(mu[at] > 0.0):
            continue
        directions, moments = rows[at, :, :3], rows[at, :, 3:]
        points = 0.5 * np.cross(directions, moments).sum(axis=1)  # p x d = m in three orthogonal directions d
        flanks.append(Flank(name, directions, points, static_force[at], mu[at]))
    return flanks


def statics_of(name: str, flanks: tuple[Flank, ...]) -> DamperStatics | None:
    """Return the limits of the flanks of a damper; None if a flank has no normal force at rest.

    Parameters
    ----------
    name
        Name of the part.
    flanks
        Its flanks, with the forces at rest.
    """
    if not all(flank.normal > 0.0 for flank in flanks):
        return None
    pull = np.sum([flank.wrench for flank in flanks], axis=0)
    limits = []
    for k, flank in enumerate(flanks):
        most = largest_ratios(flanks, k, pull)
        angle, held = _held_angles(flanks, k, pull) if flank.flat else (float("nan"), ())
        limits.append(FlankLimits(flank, most, angle, held))
    return DamperStatics(name, float(np.linalg.norm(pull[:3])), tuple(limits))


def largest_ratios(flanks: tuple[Flank, ...], k: int, pull: FloatArray) -> tuple[float, float]:
    """Return the largest T/N of flank `k` along t and along minus t in static equilibrium; NaN without an equilibrium.

    Parameters
    ----------
    flanks
        The flanks of the damper.
    k
        Position of the flank.
    pull
        (6,) resultant of the contact forces at rest, N and N m.
    """
    return _largest(flanks, k, pull, 1.0), _largest(flanks, k, pull, -1.0)


def _largest(flanks: tuple[Flank, ...], k: int, pull: FloatArray, sense: float) -> float:
    columns, friction, normal = _rays(flanks, k)
    reach = max(float(np.abs(np.concatenate([flank.points for flank in flanks])).max()), np.finfo(float).tiny)
    scale = np.r_[np.ones(3), np.full(3, 1.0 / reach)]
    # the pull is an additional unknown, as the normal force of the flank is set to one
    balance = np.column_stack([scale[:, None] * columns, -scale * pull / np.linalg.norm(pull[:3])])
    equal, right = np.vstack([balance, np.r_[normal, 0.0]]), np.r_[np.zeros(6), 1.0]
    solved = scipy.optimize.linprog(-sense * np.r_[friction, 0.0], A_eq=equal, b_eq=right)
    return -float(solved.fun) if solved.status == 0 else float("nan")


def _rays(flanks: tuple[Flank, ...], k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the wrenches (6, m) of the rays of all friction cones.

    The other results are the friction and the normal force of each ray on flank `k`.
    """
    angles = 2.0 * np.pi * np.arange(CONE_RAYS) / CONE_RAYS
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(CONE_RAYS)])
    columns, friction, normal = [], [], []
    for i, flank in enumerate(flanks):
        rays = flank.mu[:, None, None] * circle - np.array([0.0, 0.0, 1.0])  # (p, rays, 3)
        columns.append(np.einsum("prk,pkc->prc", rays, flank.wrenches).reshape(-1, 6))
        own = np.full(rays.shape[:2], float(i == k)).ravel()
        friction.append(own * rays[:, :, 0].ravel())
        normal.append(own)
    return np.concatenate(columns).T, np.concatenate(friction), np.concatenate(normal)


def _held_angles(flanks: tuple[Flank, ...], k: int, pull: FloatArray) -> tuple[float, tuple[tuple[float, float], ...]]:
    """Return the inclination of flank `k`, and its ranges without slip, degrees."""
    flank, along = flanks[k], pull[:3] / np.linalg.norm(pull[:3])
    axis, normal = flank.directions[:, 1].mean(axis=0), flank.directions[:, 2].mean(axis=0)
    axis = axis / np.linalg.norm(axis)
    cosine = float(normal @ along) / np.linalg.norm(normal)
    own = float(np.degrees(np.arccos(np.clip(abs(cosine), 0.0, 1.0))))
    # a small turn shows in which sense the flank becomes steeper
    turned = flank.turned(1e-3, axis).directions[:, 2].mean(axis=0)
    sense = 1.0 if abs(float(turned @ along)) / np.linalg.norm(turned) < abs(cosine) else -1.0

    def held(angle: float) -> bool:
        other = flank.turned(sense * np.radians(angle - own), axis)
        every, least = (*flanks[:k], other, *flanks[k + 1 :]), NO_SLIP * flank.friction
        return _largest(every, k, pull, 1.0) < least or _largest(every, k, pull, -1.0) < least

    return own, _ranges(ANGLES_DEG, np.array([held(a) for a in ANGLES_DEG], dtype=bool), held)


def _ranges(at: FloatArray, holds: BoolArray, held: Callable[[float], bool]) -> tuple[tuple[float, float], ...]:
    """Return the ranges in which `held` is true, with ends found by bisection."""
    ends = [float(at[0])] if holds[0] else []
    for j in np.flatnonzero(np.diff(holds.astype(int))):
        low, high = float(at[j]), float(at[j + 1])
        while high - low > ANGLE_TOLERANCE_DEG:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if held(middle) == holds[j] else (low, middle)
        ends.append(0.5 * (low + high))
    ends += [float(at[-1])] if holds[-1] else []
    return tuple(zip(ends[::2], ends[1::2], strict=True))
