"""``stickslip check``: models, static state, natural frequencies, choices and cost, without a run. Nothing is written."""

import math

import numpy as np

from stickslip.assembly.forces import first_nodes
from stickslip.assembly.joints.unconstrained_bodies import unheld
from stickslip.assembly.model import Model
from stickslip.study.models.study import Study
from stickslip.study.run import asked_for, of_task
from stickslip.study.store.progress import LOG
from stickslip.study.verdict import together

WARNING = "WARNING: "


def check_study(study: Study) -> tuple[str, ...]:
    """Build every model, refuse all that a run would refuse, log static state and frequencies, and return warnings.

    Raises
    ------
    InputError
        If the study cannot be run.
    """
    asked = asked_for(study)
    told: list[str] = []
    alike: list[str] = []
    for case in study.cases():
        model = case.build()
        with of_task(study, case):
            lines = [_size(model), *_free(model), *first_nodes(model.places, model.outputs)]
            lines += [*(f"{WARNING}{text}" for text in model.warnings)]
            for one in asked:
                lines += one.check(case, model)
        # what holds for all cases is said once
        new = [line for line in lines if line not in told]
        told += new
        _tell(case.label, [line for line in new if not line.startswith(WARNING)])
        if not new:
            alike.append(case.label)
    measured = study.measured
    if measured is not None:
        LOG.info(measured.sentence)
    if alike:
        LOG.info(f"the same holds for: {together(alike)}")
    return tuple(t.removeprefix(WARNING) for t in told if t.startswith(WARNING))


def _tell(label: str, lines: list[str]) -> None:
    """Log lines, preceded by the label of their case if the study has several."""
    if label and lines:
        LOG.info(label)
    for line in lines:
        LOG.info(f"  {line}" if label else line)


def _free(model: Model) -> list[str]:
    """Name the parts that are free although all contacts stick; analyses that cannot handle this refuse it themselves."""
    if model.stages is not None:
        return []
    return [f"note: {error}" for error in unheld(model, np.ones(len(model.pairs.names), dtype=bool))]


def _size(model: Model) -> str:
    facts = model.facts
    wheel = f"one of {model.sectors} sectors, " if model.sectors > 1 else ""
    if model.stages is not None:
        counts = [str(stage.sectors) for stage in model.stages.stages.values()]
        wheel = f"one sector each of stages of {' and '.join(counts)}, "
    mass = f"mass {facts.mass:.6g} kg, " if math.isfinite(facts.mass) else ""
    elements = f"{facts.elements} elements, " if facts.elements else ""
    return (
        f"{wheel}{facts.nodes} nodes, {elements}{facts.dofs} free dofs, {mass}{len(model.pairs.names)} contact points"
    )
