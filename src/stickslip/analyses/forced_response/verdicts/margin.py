"""Verdicts on the stress at the peak: utilisation, static stress above yield, mesh and reduction."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.records.columns import SurfaceStress, holds, read
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.rules import Finding
from stickslip.arrays import IntArray
from stickslip.model.strength.haigh import NO_YIELD
from stickslip.study.analysis import TextTable
from stickslip.units import millimetres

ONE_SIDED = "cyclic faces do not match: their nodes have the stress of their own sector alone"
COARSE = 0.1  # relative error of the stress by the mesh, in the energy norm, that is told
MPA = 1e6
NONE, SLIPS_MARK = "–", "*"


@dataclass(frozen=True)
class Place:
    """A node of a surface and its margin, in SI units."""

    name: str
    where: str
    alternating: float
    mean: float
    allowed: float
    utilisation: float
    mesh_error: float
    correction: float
    shakedown: bool = False


def places_of(own: SurfaceStress, at: IntArray) -> list[Place]:
    """Return places by their indices; negative ones are padding."""
    columns = (
        own.alternating_stress,
        own.mean_stress,
        own.allowed_stress,
        own.utilisation,
        own.stress_mesh_error,
        own.stress_correction,
    )
    found = []
    for k in at[at >= 0]:
        where = ", ".join(f"{1e3 * v:.2f}" for v in own.stress_point[k])
        a, m, allowed, used, error, change = (float(values[k]) for values in columns)
        name = f"node {int(own.stress_node[k])} of {own.stress_part[k]}"
        found.append(Place(name, where, a, m, allowed, used, error, change, own.stress_shakedown == 1))
    return found


def worst_of(own: SurfaceStress) -> Place | None:
    """Return the place with the largest utilisation away from singular places; None without any."""
    return next(iter(places_of(own, own.worst_place[:1])), None)


def utilisation_of(data: xr.Dataset, case: int) -> float:
    """Return the utilisation of the worst place of a case; NaN without stress, or above yield."""
    if not holds(SurfaceStress, data):
        return float("nan")
    place = worst_of(read(SurfaceStress, data, case))
    return float("nan") if place is None else place.utilisation


def size_of(value: float) -> str:
    """Return a stress as text in MPa."""
    return f"{value / MPA:.4g} MPa"


def margin_to_fatigue(case: Curve) -> Iterator[Finding]:
    """Tell the utilisation of the fatigue limit, and what limits it."""
    if not holds(SurfaceStress, case.data):
        return
    own = case.read(SurfaceStress)
    place = worst_of(own)
    if place is None:
        if np.isfinite(own.alternating_stress).any():
            why = "no place of a surface is away from contacts, joins, supports and loaded nodes, where elastic stress is singular: there is no margin"
            yield Finding("doubtful", why, "Give a smaller stress.apart_m, or a finer mesh.")
        elif own.stress_doubt:
            yield Finding("doubtful", str(own.stress_doubt), "The motion and its own verdicts stand without it.")
        return
    here = f"{place.name} ({place.where} mm)"
    if np.isnan(place.utilisation):
        yield _void(place, here)
        return
    if np.isinf(place.utilisation):
        why = f"the mean stress at {here}, {size_of(place.mean)}, is beyond the static limit: no amplitude is endured"
        yield Finding("trusted", why, "Lower the static stress, or check the limits in [stress].")
        return
    yield from _left_open(own)
    yield from _utilised(case, own, place, here)


def _utilised(case: Curve, own: SurfaceStress, place: Place, here: str) -> Iterator[Finding]:
    """Tell utilisation and amplitude at the limit, and what the reduction and the mesh leave open."""
    exceeds = "the fatigue limit is exceeded: " if place.utilisation >= 1.0 else ""
    if np.isfinite(place.allowed):
        of = f"alternating {size_of(place.alternating)} of {size_of(place.allowed)} endured at a mean of {size_of(place.mean)}"
    else:
        of = f"by {name_of(own)}; alternating {size_of(place.alternating)}, mean {size_of(place.mean)}"
    why = f"{exceeds}utilisation {place.utilisation:.3g} at {here}, {of}"
    yield Finding(
        "trusted", why, "Elastic stress at contacts, joins, supports and loaded nodes is singular and does not count."
    )
    if np.isfinite(own.allowed_amplitude):
        yield Finding("trusted", *_allowed(own))
    if place.correction > case.limit:
        why = f"modes that the reduction leaves out change the alternating stress at {place.name} by {100 * place.correction:.2g} %"
        yield Finding("doubtful", why, "Keep more modes ([reduction]).")
    if place.mesh_error > COARSE:
        why = f"the mesh is coarse at {place.name}: the error of its stress is estimated at {100 * place.mesh_error:.2g} % in the energy norm"
        yield Finding("trusted", why, "Refine the mesh there, and round sharp inner edges.")


def name_of(own: SurfaceStress) -> str:
    """Return the name of the line or criterion by which stress is judged."""
    return str(own.stress_rule).replace("_", " ").title()


def _left_open(own: SurfaceStress) -> Iterator[Finding]:
    """Tell what the margin leaves open, and limits without effect."""
    for why in filter(None, str(own.stress_doubt).split("; ")):
        known = {
            NO_YIELD: ("trusted", "Give stress.yield_pa."),
            ONE_SIDED: ("trusted", "Give both faces the same mesh."),
        }
        level, remedy = known.get(why, ("doubtful", "Check the limits in [stress], or choose another criterion."))
        yield Finding("trusted" if level == "trusted" else "doubtful", why, remedy)
    if own.stress_idle:
        yield Finding("trusted", str(own.stress_idle), "Remove what is not used, or choose the rule that uses it.")


def _allowed(own: SurfaceStress) -> tuple[str, str]:
    """Return sentence and remark on the amplitude of the report output at the limit."""
    why = f"the worst place reaches its limit at {millimetres(float(own.allowed_amplitude))} of the report output, the vibration scaled at this static stress"
    if own.stress_slips:
        return (
            why,
            "Contacts slip, open or are nonlinear springs at the peak: stress does not follow the load in proportion, so this is an estimate.",
        )
    return why, "All contacts stick: scaling is exact as long as they do."


def _void(place: Place, here: str) -> Finding:
    """Return the finding on a place without a margin: its static stress is above yield, or its amplitude is."""
    if place.shakedown:
        why = f"the alternating stress at {here}, {size_of(place.alternating)}, is above yield: the material does not shake down, and there is no margin"
        return Finding("doubtful", why, "Lower the vibration, or compute with plasticity.")
    why = f"the elastic static stress at {here} is {size_of(abs(place.mean))}, above yield: there is no margin there"
    remedy = 'Give stress.above_yield = "shakedown" if the material shakes down, or compute the static state with plasticity.'
    return Finding("doubtful", why, remedy)


def stress_table(data: xr.Dataset, labels: list[str]) -> TextTable:
    """Return the terminal table of utilisations; without rows if the study asks for none."""
    head = (
        "case",
        "utilisation",
        "alternating MPa",
        "mean MPa",
        "endured MPa",
        "amplitude at limit",
        "worst place",
        "x, y, z mm",
    )
    rows = []
    if holds(SurfaceStress, data):
        for i, label in enumerate(labels):
            own = read(SurfaceStress, data, i)
            place = worst_of(own)
            if place is not None:
                used = "void, above yield" if np.isnan(place.utilisation) else f"{place.utilisation:.3g}"
                sizes = (_cell(value / MPA) for value in (place.alternating, place.mean, place.allowed))
                limit = float(own.allowed_amplitude)
                scaled = millimetres(limit) + (SLIPS_MARK if own.stress_slips else "") if np.isfinite(limit) else NONE
                rows.append((label, used, *sizes, scaled, place.name, place.where))
    slipping = any(SLIPS_MARK in row[5] for row in rows)
    lines = (f"{SLIPS_MARK} contacts slip or open: scaled, an estimate",) if slipping else ()
    return TextTable("Stress at the peak", head, tuple(rows), lines)


def _cell(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else NONE
