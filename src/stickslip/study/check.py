"""``stickslip check``: models, static state, natural frequencies, choices and cost, without a run. Nothing is written."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.forces import first_nodes
from stickslip.assembly.joints.unconstrained_bodies import unheld
from stickslip.assembly.model import Model
from stickslip.model.facts import facts_of_part
from stickslip.model.slow_steps import step, told_when_slow
from stickslip.study.analysis import Advice
from stickslip.study.models.study import Study
from stickslip.study.run import asked_for, not_used, of_task
from stickslip.study.store.progress import LOG, tell
from stickslip.study.verdict import together

SECTIONS = {
    "computed": "What will be computed",
    "doubts": "What is likely wrong",
    "at_rest": "What contacts hold at rest",
    "beside": "What stands beside the range",
}  # field of `Advice` -> heading
DOUBTFUL = "doubtful"
START_S = 5.0  # of CPU: imports and compiled functions; `check` of four masses takes 5.6 s in all (28 Nov 2026)
NAMED_CASES = 8  # cases that a line names
OVER_SPEED = ("campbell", "run_up")  # analyses that turn a model whose [rotation] does not
FAR = 100.0  # distance of an axis over the size of a part: blades stand within some tens of their length
REACH = 0.05  # distance of a part's centre of mass from its clamped nodes over its size: less in disks
OUTWARD = 0.5  # share of it that leads away from the axis, the cosine of 60 degrees
ROUND = 0.2  # largest relative difference of the spread of a disk's nodes in two directions
NO_DOUBT = "nothing that can be seen without solving"


def check_study(study: Study) -> tuple[str, ...]:
    """Build every model, refuse what a run would refuse, log planned computations and doubts, and return the doubts.

    Raises
    ------
    InputError
        If the study cannot be run.
    """
    asked = asked_for(study)
    told, solving_s = Advice(), np.zeros(2)
    alike: list[str] = []
    for case in study.cases():
        with told_when_slow(case.label), of_task(study, case):
            with step("building the parts"):
                model = case.build()
            with step(f"pairing the points of {len(model.contacts)} contacts"):
                pairs = model.pairs
            every = [Advice(computed=(_size(model, len(pairs.names)),), doubts=tuple(not_used(study, asked)))]
            held = [part.supports for part in model.parts.values() if part.template is None and part.supports]
            every += [Advice(computed=(*held, *first_nodes(model.places, model.outputs)), doubts=model.warnings)]
            if model.speed > 0.0 or any(one.name in OVER_SPEED for one in asked):
                every += [Advice(doubts=tuple(axis_doubts(model)))]
            every += [_as_advice(one.check(case, model)) for one in asked]
            every += [Advice(at_rest=tuple(_free(model)))]
        # a line that is the same for all cases is logged once
        solving_s += np.sum([one.solving_s for one in every], axis=0)
        new, first = _new(every, told), told == Advice()
        told = _joined([told, new])
        if first and not new.doubts:
            new = replace(new, doubts=(NO_DOUBT,))
        if any(getattr(new, name) for name in SECTIONS):
            _tell(case.label, new)
        else:
            alike.append(case.label)
    measured = study.measured
    if measured is not None:
        LOG.info(measured.sentence)
    if alike:
        others = f"the other {len(alike)} cases" if len(alike) > NAMED_CASES else together(alike)
        LOG.info(f"the same holds for: {others}")
    if len(study.cases()) > 1 and solving_s[1] > 0.0:
        likely, most = (f"{s / 60:.0f} min" if s >= 120.0 else f"{s:.0f} s" for s in solving_s)
        LOG.info(f"all {len(study.cases())} cases: some {likely} to solve on one core, at most {most}")
        LOG.info(f"on top come parts, stability, audits, time integration and some {START_S:.0f} s to start")
    return told.doubts


def axis_doubts(model: Model) -> Iterator[str]:
    """Yield doubts about the axis of rotation of meshed parts that are no sectors, whose faces would not fit a wrong one."""
    for name, part in model.parts.items():
        if part.mesh is None or part.sectors > 1 or part.template is not None:
            continue
        points, key = part.mesh.points, f"part.{name}.axis_direction"
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        distance = np.linalg.norm(part.axis.arm(points), axis=1)
        line = f"the axis along {_vector(part.axis.unit)} through {_vector(np.asarray(part.axis.origin))} m"
        if distance.min() > FAR * size:
            yield (
                f"{line} passes {distance.min():.3g} m from {name}, which is {size:.3g} m large. Check the units of {name} "
                f"and of part.{name}.axis_origin_m (m)."
            )
            continue
        held = np.isin(part.mesh.numbers, np.unique(part.structure.dofs.node), invert=True)
        if not held.any() or held.all() or _round(part.axis.arm(points)):
            continue
        foot, centre = points[held].mean(axis=0), np.array(facts_of_part(part).centre)
        reach = centre - foot
        outward = float(np.diff(np.linalg.norm(part.axis.arm(np.array([foot, centre])), axis=1))[0])
        if np.linalg.norm(reach) > REACH * size and outward < OUTWARD * np.linalg.norm(reach):
            yield (
                f"{line} does not lie below {name}: from its clamped nodes to its centre of mass it reaches along "
                f"{_vector(reach / np.linalg.norm(reach))}, and the centrifugal load acts along {_vector(_outwards(part.axis.arm(centre[None])[0]))}. "
                f"Give {key} the axis of the engine, and part.{name}.axis_origin_m a point of it."
            )


def _round(arm: FloatArray) -> bool:
    """Whether points at these vectors (n, 3) from the axis are spread alike in all directions around it, as those of a disk."""
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(arm.T @ arm)[1:], 0.0))  # the axis itself has none
    around = np.linalg.norm(arm.mean(axis=0)) < ROUND * np.linalg.norm(arm, axis=1).max()
    return bool(around and spread[0] > (1.0 - ROUND) * spread[1])


def _outwards(arm: FloatArray) -> FloatArray:
    size = float(np.linalg.norm(arm))
    return arm / size if size > 0.0 else arm


def _vector(values: FloatArray) -> str:
    return f"({', '.join(f'{v + 0.0:.2g}' for v in np.round(values, 3))})"


def _as_advice(said: tuple[str, ...] | Advice) -> Advice:
    return said if isinstance(said, Advice) else Advice(computed=said)


def _joined(every: Iterable[Advice]) -> Advice:
    every = list(every)
    return Advice(**{name: tuple(line for one in every for line in getattr(one, name)) for name in SECTIONS})


def _new(every: Iterable[Advice], told: Advice) -> Advice:
    """Return the lines that were not logged before, each once."""
    joined = _joined(every)
    known = {name: set(getattr(told, name)) for name in SECTIONS}
    return Advice(**{n: tuple(dict.fromkeys(t for t in getattr(joined, n) if t not in known[n])) for n in SECTIONS})


def _tell(label: str, advice: Advice) -> None:
    """Log the lines of a case section by section, preceded by its label if the study has several."""
    if label:
        LOG.info(label)
    for name, heading in SECTIONS.items():
        lines = getattr(advice, name)
        if lines:
            LOG.info(f"{heading}:")
        for line in lines:
            if name == "doubts" and line != NO_DOUBT:
                tell(DOUBTFUL, line)
            else:
                LOG.info(f"  {line}")


def _free(model: Model) -> list[str]:
    """Name the parts that are free even if all contacts stick; analyses that cannot handle this refuse it themselves."""
    if model.stages is not None:
        return []
    return [f"note: {error}" for error in unheld(model, np.ones(len(model.pairs.names), dtype=bool))]


def _size(model: Model, points: int) -> str:
    facts = model.facts
    wheel = f"one of {model.sectors} sectors, " if model.sectors > 1 else ""
    if model.stages is not None:
        counts = [str(stage.sectors) for stage in model.stages.stages.values()]
        wheel = f"one sector each of stages of {' and '.join(counts)}, "
    mass = f"mass {facts.mass:.6g} kg, " if math.isfinite(facts.mass) else ""
    elements = f"{facts.elements} elements, " if facts.elements else ""
    return f"{wheel}{facts.nodes} nodes, {elements}{facts.dofs} free dofs, {mass}{points} contact points"
