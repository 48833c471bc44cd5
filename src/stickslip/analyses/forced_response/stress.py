"""Stress at the peak and its margin to the fatigue limit."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.analyses.forced_response.problem import Question, StressAsked
from stickslip.analyses.forced_response.records.columns import STRESS_AT, SurfaceStress, stored
from stickslip.analyses.forced_response.records.points import Response
from stickslip.analyses.forced_response.records.values import Values, texts
from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.assembly.forces import force_of
from stickslip.assembly.full_field import NodeMotion, node_motion
from stickslip.assembly.model import Model
from stickslip.errors import InputError
from stickslip.model.fe.stress import nodal_stress, stress_error, stress_places
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import Part
from stickslip.model.strength import alternating_and_mean, margin
from stickslip.response.forced.response import ForcedPoint
from stickslip.study.exchange.chosen import FORCED, Chosen
from stickslip.study.exchange.motion import expanded

WORST = 10  # places whose cycle is stored


@dataclass(frozen=True, eq=False)
class _OfPart:
    """Stress at the surface nodes of a part, one sector."""

    node: IntArray  # (k,) indices of mesh nodes
    at: IntArray  # (k,) codes by `STRESS_AT`
    triangles: IntArray  # (f, 3) places
    harmonics: ComplexArray  # (H+1, k, 6) Pa
    uncorrected: FloatArray  # (k,) alternating stress without the static correction, Pa
    error: FloatArray  # (k,) estimated error of the vibration's stress by the mesh, relative


def of_stress(question: Question, response: Response) -> Values:
    """Return the stress at the peak of a case and its margin; nothing if the study does not ask for it.

    A case whose stress cannot be computed has no places, and the reason.
    """
    asked, top = question.stress, response.top
    if asked is None:
        return {}
    if top is None or not top.point.converged:
        return _unknown(asked, "there is no peak whose stress could be computed")
    try:
        each = _of_parts(question, asked, top.point)
    except InputError as error:  # the response is solved: it stays
        return _unknown(asked, f"the stress at the peak was not computed: {error.problem}")
    harmonics = np.concatenate([own.harmonics for own in each.values()], axis=1)
    alternating, mean = alternating_and_mean(harmonics)
    found = margin(
        asked.mean_stress,
        asked.card,
        alternating,
        mean,
        above_yield=asked.above_yield,
        credit_in_compression=asked.credit_in_compression,
    )
    uncorrected = np.concatenate([own.uncorrected for own in each.values()])
    at = np.concatenate([own.at for own in each.values()])
    order = _worst(found.utilisation, alternating, at)
    counts = [own.node.size for own in each.values()]
    first = np.cumsum([0, *counts])
    meshes = [_mesh(asked.model.parts[name]) for name in each]
    cycle = harmonics[:, order]
    return stored(
        SurfaceStress(
            stress_point=np.concatenate([m.points[own.node] for m, own in zip(meshes, each.values(), strict=True)]),
            stress_node=np.concatenate([m.numbers[own.node] for m, own in zip(meshes, each.values(), strict=True)]),
            stress_part=texts(name for name, n in zip(each, counts, strict=True) for _ in range(n)),
            stress_triangle=np.vstack([own.triangles + n for own, n in zip(each.values(), first, strict=False)]),
            stress_at=at,
            alternating_stress=alternating,
            mean_stress=np.where(np.isfinite(found.mean), found.mean, mean),
            allowed_stress=found.allowed,
            utilisation=found.utilisation,
            stress_mesh_error=np.concatenate([own.error for own in each.values()]),
            stress_correction=_relative(alternating - uncorrected, alternating),
            worst_place=order,
            worst_stress=np.stack([cycle.real, cycle.imag], axis=-1),
            stress_doubt=found.doubt,
            stress_shakedown=int(asked.above_yield == "shakedown"),
            fatigue_limit=float(np.max(asked.card.fatigue_limit_pa)),
            haigh_mean=asked.line[0],
            haigh_amplitude=asked.line[1],
        )
    )


def _unknown(asked: StressAsked, why: str) -> Values:
    """Return the variables of a case without stress, which other cases may have."""
    none, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    return stored(
        SurfaceStress(
            stress_point=np.zeros((0, 3)),
            stress_node=whole,
            stress_part=texts(()),
            stress_triangle=np.zeros((0, 3), dtype=np.int64),
            stress_at=whole,
            alternating_stress=none,
            mean_stress=none,
            allowed_stress=none,
            utilisation=none,
            stress_mesh_error=none,
            stress_correction=none,
            worst_place=whole,
            worst_stress=np.zeros((0, 0, 6, 2)),
            stress_doubt=why,
            stress_shakedown=int(asked.above_yield == "shakedown"),
            fatigue_limit=float(np.max(asked.card.fatigue_limit_pa)),
            haigh_mean=asked.line[0],
            haigh_amplitude=asked.line[1],
        )
    )


def _relative(change: FloatArray, of: FloatArray) -> FloatArray:
    return np.divide(np.abs(change), of, out=np.zeros_like(of), where=of > 0)


def _worst(utilisation: FloatArray, alternating: FloatArray, at: IntArray) -> IntArray:
    """Return the places with the largest utilisation away from contacts, joins, supports and loads, the worst first; void ones lead."""
    rank = np.where(np.isnan(utilisation), np.inf, utilisation)
    rank = np.where(at == 0, rank, -1.0)
    order = np.lexsort((-alternating, -rank))[:WORST]
    return np.asarray(order[at[order] == 0])


def _of_parts(question: Question, asked: StressAsked, point: ForcedPoint) -> dict[str, _OfPart]:
    """Return the stress of every meshed part."""
    assembled = question.model
    motion = question.problem.low.linear.recover(point.omega, point.coefficients)
    told = Chosen(
        FORCED,
        "the peak",
        question.label,
        point.omega,
        assembled.system.retained_labels,
        point.coefficients,
        assembled.output_labels,
        motion[:, assembled.system.outputs],
        orders=asked.orders,
    )
    whole, fields = expanded(told, asked.model)
    moved = node_motion(asked.model, whole, fields, point.omega)
    return {name: _of_part(asked, name, own) for name, own in moved.items()}


def _of_part(asked: StressAsked, name: str, moved: NodeMotion) -> _OfPart:
    part = asked.model.parts[name]
    solid, mesh = part.solid, _mesh(part)
    assert solid is not None
    places = stress_places(solid.laws)
    skin = np.unique(mesh.surface)
    rows = np.flatnonzero(np.isin(places.node, skin))
    whole = moved.whole
    live = [h for h in range(1, len(whole)) if np.any(whole[h])]
    harmonics = np.zeros((len(whole), rows.size, 6), dtype=complex)
    harmonics[0] = nodal_stress(solid, whole[:1].real, heated=solid.heated)[0, rows]
    plain = harmonics.copy()
    if live:
        harmonics[live] = nodal_stress(solid, whole[live])[:, rows]
        plain[live] = nodal_stress(solid, moved.reduced[live])[:, rows]
    largest = max(live, key=lambda h: float(np.abs(harmonics[h]).max()), default=0)
    error = stress_error(solid, whole[largest : largest + 1]).local[0, rows] if live else np.zeros(rows.size)
    first = np.searchsorted(places.node[rows], mesh.surface)
    return _OfPart(
        node=places.node[rows],
        at=_codes(asked, name, mesh)[places.node[rows]],
        triangles=first,
        harmonics=harmonics,
        uncorrected=alternating_and_mean(plain)[0],
        error=error,
    )


def _mesh(part: Part) -> SolidMesh:
    assert part.mesh is not None
    return part.mesh


def _codes(asked: StressAsked, name: str, mesh: SolidMesh) -> IntArray:
    """Return (nodes,) codes by `STRESS_AT`: what makes the elastic stress at a node singular."""
    found = np.zeros(len(mesh.points), dtype=np.int64)
    marked = _singular_nodes(asked.model, name)
    for code in range(len(STRESS_AT) - 1, 0, -1):  # contacts are told before joints, supports and loads
        found[_around(mesh, marked[STRESS_AT[code]], asked.apart)] = code
    return found


def _around(mesh: SolidMesh, marked: BoolArray, apart: float | None) -> BoolArray:
    """Return the nodes near marked ones: in the same cells, or within a distance in m."""
    if not marked.any():
        return marked
    if apart is not None:
        distance, _ = scipy.spatial.KDTree(mesh.points[marked]).query(mesh.points)
        return np.asarray(distance <= apart)
    used = mesh.cells >= 0
    touched = (marked[mesh.cells] & used).any(axis=1)
    near = marked.copy()
    near[mesh.cells[touched][used[touched]]] = True
    return near


def _singular_nodes(model: Model, name: str) -> Mapping[str, BoolArray]:
    """Return masks (nodes,) of the nodes of a part at contacts, joints, supports and point loads."""
    part, pairs, ties = model.parts[name], model.pairs, model.ties
    assert part.solid is not None
    dofs = model.places.own(name)
    onto = part.solid.onto
    loads = {name: load for name, load in model.loads.items() if load.field is None}
    pulled = [np.flatnonzero(force_of(model.places, name, load)) for name, load in loads.items()]
    of = {
        "contact": np.concatenate([pairs.own.nonzero()[1], pairs.following.nonzero()[1]]),
        "joint": np.concatenate([ties.followers, ties.weights.nonzero()[1]]),
        "load": np.concatenate([np.zeros(0, dtype=np.int64), *pulled]),
    }
    found: dict[str, BoolArray] = {}
    for what, members in of.items():
        felt = onto[:, np.isin(dofs, members)]
        found[what] = np.asarray((np.diff(felt.indptr) > 0).reshape(-1, 3).any(axis=1))
    used = np.isin(np.arange(len(_mesh(part).points)), _mesh(part).cells)
    return found | {"support": ~part.solid.free & used}
