"""Whether a node of a result is the baseline's: to the last bit, or states alike and fields to a tolerance."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from evidence.baseline.results import Node

TOLERANCE = 1e-8  # of fields, of their largest value in the case
ROUNDING = 1e-9  # of the largest value of all cases: smaller ones are rounding, as dissipated energy where all sticks
SAME_FREQUENCY = 1e-9  # relative: points of one frequency
OTHER_MOTION = (
    1e-3  # relative: two motions of one frequency that differ by more are two branches of a fold
)
NEAR = 1e-2  # of the range: how far a point of the baseline may lie from today's curve where no point has its frequency
# what must be equal, of each point and of each case
STATES = ("status", "order", "harmonic_kept")
CASES = ("points_failed", "peak_state")
FIELDS = ("output_displacement", "contact_force", "dissipated_energy")
STATIC = ("static_gap", "static_force")
PICTURE = (
    "skin_cut",
)  # which triangles are not drawn; joined shrouds are a join now, and their faces are drawn
# labels and positions that a later layout may write otherwise
NUMBERS = "biuf"


@dataclass(frozen=True)
class Finding:
    """One comparison: what was compared, whether it holds, and what was found."""

    what: str
    holds: bool
    found: str


def digest(values: np.ndarray) -> str:
    """Return a hash of kind, shape and bits."""
    whole = np.ascontiguousarray(values)
    head = f"{whole.dtype.str} {whole.shape} "
    return hashlib.sha256(head.encode() + whole.tobytes()).hexdigest()


def differing(digests: Mapping[str, str], node: Node) -> list[str]:
    """Return the variables that lack or differ in a bit."""
    return [name for name, old in digests.items() if name not in node or digest(node[name]) != old]


def compare_table(old: Node, new: Node) -> list[Finding]:
    """Compare modes, Campbell diagrams and interference tables: whole numbers equal, others to the tolerance."""
    findings = []
    for name, values in old.items():
        if name in PICTURE:
            continue
        if name not in new or new[name].shape != values.shape:
            findings.append(Finding(name, holds=False, found=f"missing, or not {values.shape}"))
        elif values.dtype.kind == "f":
            findings.append(_close(name, values, new[name]))
        else:
            same = bool(np.array_equal(values, new[name]))
            findings.append(Finding(name, same, "equal" if same else "not equal"))
    return findings


def _close(name: str, old: np.ndarray, new: np.ndarray, least: float = 0.0) -> Finding:
    worst = _worst(old, new, least)
    return Finding(name, worst <= TOLERANCE, f"differs by {worst:.1e}")


def _worst(old: np.ndarray, new: np.ndarray, least: float = 0.0) -> float:
    """Return the largest difference over the largest value, or over `least`; infinite where only one of them is a number."""
    if not np.array_equal(np.isnan(old), np.isnan(new)):
        return np.inf
    scale = max(float(np.nanmax(np.abs(old), initial=0.0)), least)
    return float(np.nanmax(np.abs(new - old), initial=0.0)) / scale if scale else 0.0


def compare_forced(old: Node, new: Node) -> list[Finding]:
    """Compare a forced response: cases as tables, points at equal frequency, the others by their distance from the curve."""
    cases = {name: old[name] for name in (*CASES, *STATIC) if name in old}
    findings = compare_table(cases, new)
    least = {n: ROUNDING * float(np.nanmax(np.abs(old[n]), initial=0.0)) for n in FIELDS}
    for case in range(int(old["point_case"].max()) + 1):
        mine, its = (_points(node, case) for node in (old, new))
        findings += [
            Finding(f"case {case}: {one.what}", one.holds, one.found)
            for one in _case(mine, its, least)
        ]
    return findings


def _points(node: Node, case: int) -> Node:
    here = node["point_case"] == case
    return {name: node[name][here] for name in ("frequency_hz", *STATES, *FIELDS)}


def _case(old: Node, new: Node, least: Mapping[str, float]) -> list[Finding]:
    partner = _partners(old, new)
    met = partner >= 0
    count = (
        f"{met.sum()} of {len(met)} points at the same frequency, {len(new['frequency_hz'])} today"
    )
    found = [Finding("points", bool(met.mean() > 0.5), count)]
    for name in STATES:
        same = bool(np.array_equal(old[name][met], new[name][partner[met]]))
        found.append(Finding(name, same, "equal" if same else "not equal"))
    found += [_close(n, old[n][met], new[n][partner[met]], least[n]) for n in FIELDS]
    if not met.all():
        far = _distance(_curve(old)[~met], _curve(new))
        found.append(Finding("other points", far <= NEAR, f"{far:.1e} of the range off the curve"))
    return found


def _partners(old: Node, new: Node) -> np.ndarray:
    """Return, for each point, that of today at its frequency; of several, on a fold, the nearest; -1 for none."""
    found = np.full(len(old["frequency_hz"]), -1)
    for i, hz in enumerate(old["frequency_hz"]):
        fold = _at(old, hz).size > 1
        near = _at(new, hz)
        motion = old["output_displacement"][i]
        off = np.nansum(np.abs(new["output_displacement"][near] - motion), axis=(1, 2, 3))
        if near.size and not (fold and off.min() > OTHER_MOTION * np.nansum(np.abs(motion))):
            found[i] = near[np.argmin(off)]
    return found


def _at(node: Node, hz: float) -> np.ndarray:
    return np.flatnonzero(np.abs(node["frequency_hz"] - hz) <= SAME_FREQUENCY * hz)


def _curve(node: Node) -> np.ndarray:
    """Return frequency and size of the motion at each point."""
    size = np.sqrt(np.nansum(node["output_displacement"] ** 2, axis=(1, 2, 3)))
    return np.stack([node["frequency_hz"], size], axis=1)


def _distance(points: np.ndarray, curve: np.ndarray) -> float:
    """Return the largest distance of points from a polygon, both axes scaled by the curve's range."""
    scale = np.ptp(curve, axis=0)
    points, curve = points / scale, curve / scale
    start, along = curve[:-1], np.diff(curve, axis=0)
    length = np.maximum((along**2).sum(axis=1), 1e-300)
    share = ((points[:, None] - start) * along).sum(axis=2) / length
    foot = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return float(np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1).max())
