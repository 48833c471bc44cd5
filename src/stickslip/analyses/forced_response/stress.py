"""Stress at the peak, a note of the job, and its margin to the fatigue limit by the card of a case."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from hashlib import sha256
from typing import Any

import numpy as np
import scipy

from stickslip.analyses.forced_response.problem import Question, StressAsked, card_of, no_solid
from stickslip.analyses.forced_response.records.columns import STRESS_AT, SurfaceStress, stored
from stickslip.analyses.forced_response.records.values import Values, texts
from stickslip.analyses.forced_response.verdicts.margin import ONE_SIDED
from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.assembly.forces import force_of
from stickslip.assembly.full_field import NodeMotion, node_motion
from stickslip.assembly.model import Model
from stickslip.errors import InputError
from stickslip.model.fe.stress import Neighbours, nodal_stress, stress_error, stress_places
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import Part
from stickslip.model.strength import (
    Margin,
    StrengthCard,
    allowable_amplitude,
    alternating_and_mean,
    criterion_doubt,
    margin,
)
from stickslip.model.strength.cycle import CRITERIA, worst_utilisation
from stickslip.model.strength.haigh import NO_YIELD
from stickslip.response.forced.collected import Response
from stickslip.response.forced.response import ForcedPoint
from stickslip.response.stability.flow_map.contact_states import is_located
from stickslip.study.exchange.chosen import FORCED, Chosen
from stickslip.study.exchange.motion import expanded
from stickslip.study.file.model.strength import Stress

WORST = 10  # places whose cycle is stored
HAIGH_POINTS = 65  # of the line of a Haigh diagram
KEPT = 1e-7  # of the largest stress: harmonics below are not stored
MOST_SCALE = 1e6  # of the vibration, beyond which its allowed amplitude is not looked for
SCALE_RTOL = 1e-5  # excess of the utilisation at the amplitude at the limit: waves are stored in single precision
KINDS = STRESS_AT[1:]


@dataclass(frozen=True, eq=False)
class _OfPart:
    """Stress at the surface nodes of a part, one sector."""

    node: IntArray  # (k,) indices of mesh nodes
    near: BoolArray  # (kinds, k) whether a cell around the node has a node of `KINDS`
    distance: FloatArray  # (kinds, k) to the next node of `KINDS`, m
    temperature: FloatArray  # (k,) NaN without one
    triangles: IntArray  # (f, 3) places
    harmonics: ComplexArray  # (H+1, k, 6) Pa
    uncorrected: FloatArray  # (k,) alternating stress without the static correction, Pa
    error: FloatArray  # (k,) estimated error of the vibration's stress by the mesh, relative
    one_sided: bool  # whether nodes on cyclic faces have the stress of one side


@dataclass(frozen=True, eq=False, kw_only=True)
class PeakStress:
    """Stress at the peak of a job, which no card changes: the content of its note."""

    point: FloatArray  # (k, 3) m
    node: IntArray  # (k,) numbers of the mesh
    part: Any  # (k,) texts
    triangle: IntArray  # (f, 3)
    near: BoolArray  # (kinds, k) as of `_OfPart`
    distance: FloatArray
    temperature: FloatArray
    alternating: FloatArray  # (k,) Pa
    mean: FloatArray  # (k,) Pa
    uncorrected: FloatArray
    error: FloatArray
    orders: IntArray  # (n,) harmonics that are kept; the highest gives their number
    waves: ComplexArray  # (n, k, 6) Pa, single precision
    one_sided: int  # parts whose cyclic faces have the stress of one side, as their meshes do not match
    doubt: str  # why there is none
    linear: bool = (
        False  # whether all contacts are linear while they stick: then stress follows the load as long as they do
    )

    @property
    def harmonics(self) -> ComplexArray:
        """(H+1, k, 6) stress in each harmonic, Pa."""
        found = np.zeros((int(self.orders.max(initial=0)) + 1, *self.waves.shape[1:]), dtype=complex)
        found[self.orders] = self.waves
        return found

    @property
    def digest(self) -> str:
        """Hash of everything."""
        found = sha256()
        for value in vars(self).values():
            found.update(np.ascontiguousarray(value).tobytes())
        return found.hexdigest()


def of_stress(question: Question, response: Response) -> Values:
    """Return the note of the stress at the peak of a case; without places, but with the reason, if there is none."""
    asked, top = question.stress, response.top
    assert asked is not None
    if top is None or not top.point.converged:
        return _nothing("there is no peak whose stress could be computed")
    try:
        each = _of_parts(question, asked, top.point)
    except InputError as error:  # the response is solved: it stays
        return _nothing(f"the stress at the peak was not computed: {str(error).rstrip('.')}")
    harmonics = np.concatenate([own.harmonics for own in each.values()], axis=1)
    alternating, mean = alternating_and_mean(harmonics)
    sizes = np.abs(harmonics).max(axis=(1, 2), initial=0.0)
    kept = np.flatnonzero((sizes > KEPT * sizes.max(initial=0.0)) | (np.arange(len(sizes)) == 0))
    counts = [own.node.size for own in each.values()]
    first = np.cumsum([0, *counts])
    meshes = [_mesh(asked.model.parts[name]) for name in each]
    found = PeakStress(
        point=np.concatenate([m.points[own.node] for m, own in zip(meshes, each.values(), strict=True)]),
        node=np.concatenate([m.numbers[own.node] for m, own in zip(meshes, each.values(), strict=True)]),
        part=texts(name for name, n in zip(each, counts, strict=True) for _ in range(n)),
        triangle=np.vstack([own.triangles + n for own, n in zip(each.values(), first, strict=False)]),
        near=np.concatenate([own.near for own in each.values()], axis=1),
        distance=np.concatenate([own.distance for own in each.values()], axis=1),
        temperature=np.concatenate([own.temperature for own in each.values()]),
        alternating=alternating,
        mean=mean,
        uncorrected=np.concatenate([own.uncorrected for own in each.values()]),
        error=np.concatenate([own.error for own in each.values()]),
        orders=kept,
        waves=harmonics[kept].astype(np.complex64),
        one_sided=sum(own.one_sided for own in each.values()),
        doubt="",
        linear=all(map(is_located, question.model.system.interface.laws)),
    )
    return dict(vars(found))


def _nothing(why: str) -> Values:
    none, whole, rows = np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((len(KINDS), 0))
    found = PeakStress(
        point=np.zeros((0, 3)),
        node=whole,
        part=texts(()),
        triangle=np.zeros((0, 3), dtype=np.int64),
        near=rows.astype(bool),
        distance=rows,
        temperature=none,
        alternating=none,
        mean=none,
        uncorrected=none,
        error=none,
        orders=whole,
        waves=np.zeros((0, 0, 6), dtype=np.complex64),
        one_sided=0,
        doubt=why,
    )
    return dict(vars(found))


@dataclass(frozen=True)
class _Judging:
    """Stress and table of a case; equal ones have the same margin."""

    strength: str
    digest: str
    table: Stress = field(compare=False)
    stress: PeakStress = field(compare=False)


def with_margin(table: Stress, note: Mapping[str, Any], amplitude: float, *, slips: bool) -> Values:
    """Return the variables of the stress and of its margin of a case.

    Parameters
    ----------
    table
        The table [stress] of the case.
    note
        What `of_stress` returned.
    amplitude
        Amplitude of the report output at the peak, m.
    slips
        Whether a contact slips or opens at the peak.
    """
    stress = PeakStress(**note)
    found, scale = _judged(_Judging(table.model_dump_json(), stress.digest, table, stress))
    more = SurfaceStress(**found, allowed_amplitude=scale * amplitude, stress_slips=int(slips or not stress.linear))
    return stored(more)


@lru_cache(maxsize=128)  # criteria take seconds, and a dataset is made more than once
def _judged(asked: _Judging) -> tuple[dict[str, Any], float]:
    """Return the variables but those of the amplitude, and the factor on the vibration at which the limit is reached."""
    table, stress = asked.table, asked.stress
    try:
        cards = _cards(table, stress)
    except InputError as error:
        cards, stress = [], PeakStress(**_nothing(f"no margin was computed: {str(error).rstrip('.')}"))
    at = _codes(stress, table.apart_m)
    found = _margins(table, stress, cards, at == 0)
    order = _worst(found.utilisation, stress.alternating, at)
    cycle = stress.harmonics[:, order]
    shown = _shown(table, stress, cards, order)
    line = _line(table, shown)
    values = {
        "stress_point": stress.point,
        "stress_node": stress.node,
        "stress_part": stress.part,
        "stress_triangle": stress.triangle,
        "stress_at": at,
        "alternating_stress": stress.alternating,
        "mean_stress": np.where(np.isfinite(found.mean), found.mean, stress.mean),
        "static_stress": stress.harmonics[0].real if stress.orders.size else np.zeros((0, 6)),
        "allowed_stress": found.allowed,
        "utilisation": found.utilisation,
        "stress_mesh_error": stress.error,
        "stress_correction": _relative(stress.alternating - stress.uncorrected, stress.alternating),
        "worst_place": order,
        "worst_stress": np.stack([cycle.real, cycle.imag], axis=-1),
        "stress_doubt": stress.doubt or found.doubt,
        "stress_idle": table.idle,
        "stress_rule": table.rule,
        "stress_shakedown": int(table.above_yield == "shakedown"),
        "fatigue_limit": float(np.max(shown.fatigue_limit_pa)),
        "haigh_mean": line[0],
        "haigh_amplitude": line[1],
    }
    return values, _scale(table, stress, cards, found.utilisation, at)


def _cards(table: Stress, stress: PeakStress) -> list[tuple[IntArray, StrengthCard]]:
    """Return places and card of each part."""
    parts = dict.fromkeys(stress.part.tolist())
    for name in table.card if parts else ():
        if name not in parts:
            raise no_solid(name, list(parts))
    each = [np.flatnonzero(stress.part == name) for name in parts]
    return [(at, card_of(table, name, stress.temperature[at])) for name, at in zip(parts, each, strict=True)]


@dataclass(frozen=True, eq=False)
class _Margins:
    """Of all places: mean stress after shakedown and allowed stress, Pa, NaN with a criterion; utilisation; what is doubtful."""

    mean: FloatArray
    allowed: FloatArray
    utilisation: FloatArray
    doubt: str


def _margins(
    table: Stress, stress: PeakStress, cards: list[tuple[IntArray, StrengthCard]], counted: BoolArray
) -> _Margins:
    mean, allowed, utilisation = np.full((3, len(stress.point)), np.nan)
    doubts: dict[str, None] = {}
    for at, card in cards:
        if table.criterion is None:
            own = _by_line(table, card, stress.alternating[at], stress.mean[at])
            mean[at], allowed[at], utilisation[at] = own.mean, own.allowed, own.utilisation
            doubts[own.doubt] = None
        else:
            utilisation[at] = worst_utilisation(
                table.criterion,
                stress.harmonics[:, at],
                card,
                counted[at],
                credit_in_compression=table.credit_in_compression,
            )
            doubts[criterion_doubt(table.criterion, card)] = None
            doubts[NO_YIELD if card.yield_pa is None else ""] = None
    doubts[ONE_SIDED if stress.one_sided else ""] = None
    return _Margins(mean, allowed, utilisation, "; ".join(filter(None, doubts)))


def _by_line(table: Stress, card: StrengthCard, alternating: FloatArray, mean: FloatArray) -> Margin:
    return margin(
        table.mean_stress,
        card,
        alternating,
        mean,
        above_yield=table.above_yield,
        credit_in_compression=table.credit_in_compression,
    )


def _scale(
    table: Stress,
    stress: PeakStress,
    cards: list[tuple[IntArray, StrengthCard]],
    utilisation: FloatArray,
    at: IntArray,
) -> float:
    """Return the factor on the vibration, at a fixed static stress, at which the first place reaches its limit.

    NaN without a margin, 0 where the static stress alone exceeds it. Of a line of the Haigh diagram without shakedown it is the inverse
    of the largest utilisation. Else the utilisation rises with the factor, and other places may lead there: those that do join the worst
    ones of today, until none exceeds its limit.
    """
    places = _worst(utilisation, stress.alternating, at)
    if not places.size or np.isnan(utilisation[places[0]]):
        return math.nan
    if table.criterion is None and table.above_yield == "void":
        return 1.0 / float(utilisation[places[0]]) if utilisation[places[0]] > 0 else math.inf
    while True:
        factor = _scale_of(table, stress, cards, places)
        if factor == 0.0:
            return factor
        there = _scaled(stress, min(factor, MOST_SCALE))
        found = _margins(table, there, cards, at == 0).utilisation
        leading = _worst(found, there.alternating, at)
        more = leading[~(found[leading] <= 1.0 + SCALE_RTOL)]
        if np.isin(more, places).all():
            return factor
        places = np.union1d(places, more)


def _scaled(stress: PeakStress, factor: float) -> PeakStress:
    """Return the stress with all its vibration scaled."""
    by = np.where(stress.orders > 0, factor, 1.0)[:, None, None]
    return replace(stress, waves=stress.waves * by, alternating=factor * stress.alternating)


def _scale_of(table: Stress, stress: PeakStress, cards: list[tuple[IntArray, StrengthCard]], places: IntArray) -> float:
    """Return the factor on the vibration at which one of some places reaches its limit; infinite beyond `MOST_SCALE`."""
    each = [
        (own, card.take(np.flatnonzero(np.isin(at, own))))
        for at, card in cards
        if (own := at[np.isin(at, places)]).size
    ]
    waves = stress.harmonics

    def above(factor: float) -> float:
        worst = 0.0
        for at, card in each:
            moved = waves[:, at] * np.where(np.arange(len(waves)) > 0, factor, 1.0)[:, None, None]
            if table.criterion is None:
                used = _by_line(table, card, factor * stress.alternating[at], stress.mean[at]).utilisation
            else:
                used = CRITERIA[table.criterion](moved, card, credit_in_compression=table.credit_in_compression)
            worst = max(worst, float(np.nan_to_num(used, nan=MOST_SCALE, posinf=MOST_SCALE).max()))
        return min(worst, MOST_SCALE) - 1.0

    high = 1.0
    while above(high) < 0:
        high *= 2.0
        if high > MOST_SCALE:
            return math.inf
    if above(0.0) >= 0:
        return 0.0
    return float(scipy.optimize.brentq(above, 0.0, high, rtol=1e-6))


def _shown(
    table: Stress, stress: PeakStress, cards: list[tuple[IntArray, StrengthCard]], order: IntArray
) -> StrengthCard:
    """Return the card of the worst place, else of the first part, at one temperature."""
    for at, card in cards:
        if order.size and order[0] in at:
            return card.take(np.flatnonzero(at == order[0]))
    card = next(own for own in (*table.card.values(), table) if own.has_limit).strength()
    return card.at(np.array(card.temperatures[:1])) if card.temperatures else card


def _line(table: Stress, card: StrengthCard) -> tuple[FloatArray, FloatArray]:
    """Return mean stress and allowed amplitude of the Haigh diagram, (n,) each, Pa; NaN with a criterion."""
    if table.criterion is not None:
        return np.full(HAIGH_POINTS, np.nan), np.full(HAIGH_POINTS, np.nan)
    limits = (card.yield_pa, card.ultimate_pa, card.fracture_pa, card.fatigue_limit_pa)
    end = next(float(np.max(limit)) for limit in limits if limit is not None)
    mean = np.linspace(-end, end, HAIGH_POINTS)
    credit = table.credit_in_compression
    return mean, allowable_amplitude(table.mean_stress, card, mean, credit_in_compression=credit)


def _relative(change: FloatArray, of: FloatArray) -> FloatArray:
    return np.divide(np.abs(change), of, out=np.zeros_like(of), where=of > 0)


def _worst(utilisation: FloatArray, alternating: FloatArray, at: IntArray) -> IntArray:
    """Return the places with the largest utilisation away from contacts, joins, supports and loads, the worst first; void ones lead."""
    rank = np.where(np.isnan(utilisation), np.inf, utilisation)
    rank = np.where(at == 0, rank, -1.0)
    order = np.lexsort((-alternating, -rank))[:WORST]
    return np.asarray(order[at[order] == 0])


def _codes(stress: PeakStress, apart: float | None) -> IntArray:
    """Return (k,) codes by `STRESS_AT`: what makes the elastic stress at a place singular."""
    found = np.zeros(len(stress.point), dtype=np.int64)
    close = stress.near if apart is None else stress.distance <= apart
    for kind in reversed(range(len(KINDS))):  # contacts are told before joints, supports and loads
        found[close[kind]] = 1 + kind
    return found


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
    phases = moved.phases
    beside = None if moved.faces is None else Neighbours(moved.faces, part.axis.rotation(2 * np.pi / part.sectors))
    harmonics = np.zeros((len(whole), rows.size, 6), dtype=complex)
    harmonics[0] = nodal_stress(solid, whole[:1].real, heated=solid.heated, neighbours=beside)[0, rows]
    plain = harmonics.copy()
    if live:
        waving = None if beside is None else beside.at(phases[live])
        harmonics[live] = nodal_stress(solid, whole[live], neighbours=waving)[:, rows]
        plain[live] = nodal_stress(solid, moved.reduced[live], neighbours=waving)[:, rows]
    largest = max(live, key=lambda h: float(np.abs(harmonics[h]).max()), default=0)
    error = np.zeros(rows.size)
    if live:
        waving = None if beside is None else beside.at(phases[largest : largest + 1])
        error = stress_error(solid, whole[largest : largest + 1], neighbours=waving).local[0, rows]
    marked = _singular_nodes(asked.model, name)
    node = places.node[rows]
    hot = np.full(len(mesh.points), np.nan) if solid.temperature is None else solid.temperature.values
    return _OfPart(
        node=node,
        near=np.stack([_around(mesh, marked[kind])[node] for kind in KINDS]),
        distance=np.stack([_distance(mesh, marked[kind])[node] for kind in KINDS]),
        temperature=hot[node],
        triangles=np.searchsorted(node, mesh.surface),
        harmonics=harmonics,
        uncorrected=alternating_and_mean(plain)[0],
        error=error,
        one_sided=moved.faces is None and part.sectors > 1 and any(face in part.structure.sets for face in part.faces),
    )


def _mesh(part: Part) -> SolidMesh:
    assert part.mesh is not None
    return part.mesh


def _around(mesh: SolidMesh, marked: BoolArray) -> BoolArray:
    """Return the nodes in the same cells as marked ones."""
    used = mesh.cells >= 0
    touched = (marked[mesh.cells] & used).any(axis=1)
    near = marked.copy()
    near[mesh.cells[touched][used[touched]]] = True
    return near


def _distance(mesh: SolidMesh, marked: BoolArray) -> FloatArray:
    """Return the distance of each node to the next marked one, m."""
    if not marked.any():
        return np.full(len(marked), np.inf)
    return np.asarray(scipy.spatial.KDTree(mesh.points[marked]).query(mesh.points)[0])


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
