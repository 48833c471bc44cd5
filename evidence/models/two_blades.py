"""The example study of two blades and a damper, as evidence solves it: one system, loads of any ratio."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.analyses.forced_response.analysis import FORCED_RESPONSE
from stickslip.analyses.forced_response.problem import Question, question_of
from stickslip.arrays import IntArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.collected import Response, collect
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.study.analysis import Case, Job, Solved
from stickslip.study.jobs import solve_job
from stickslip.study.models.study import read_study
from stickslip.study.store.journal import JobJournal
from stickslip.study.verdict import LEVELS, Level

STUDY = Path(__file__).with_suffix(".toml")
SHIPPED = Path(__file__).parents[2] / "examples" / "two_blades" / "study.toml"
SIZES = ("airfoil_size_m", "platform_size_m", "foot_size_m")
COARSER = 2.0  # times the element sizes of the example: minutes where it needs hours
RATIO = "load.shaker.ratio"


@dataclass(frozen=True, eq=False)
class TwoBlades:
    """The reduced example.

    Attributes
    ----------
    question
        The forced response of the study's first ratio.
    ratios
        F_CL / F_HE of all its cases.
    cases
        Of the study, in the order of the ratios.
    """

    question: Question
    ratios: tuple[float, ...]
    cases: tuple[Case, ...]

    @property
    def system(self) -> System:
        """What vibrates."""
        return self.question.model.system

    @property
    def sweep(self) -> Sweep:
        """How the study sweeps."""
        return self.question.sweep

    def load(self, ratio: float) -> HarmonicLoad:
        """Return the loads of a ratio."""
        known = self.question.model.load
        shake = known.harmonics[1] * (self.ratios[0] / ratio)
        return HarmonicLoad(known.static, {1: shake})

    def at(self, ratio: float) -> Question:
        """Return the forced response of a ratio as a job of the study has it."""
        model = self.question.model
        excitation = model.excitation * self.ratios[0] / ratio
        model = replace(model, load=self.load(ratio), excitation=excitation)
        return replace(self.question, model=model, label=f"{RATIO} = {ratio:g}")

    def response(self, ratio: float) -> Response:
        """Compute the response of a ratio as a run does."""
        question = self.at(ratio)
        points = list(forced_response(self.system, question.model.load, self.sweep))
        return collect(question.problem, points, question.model.peak_output)

    def judged(self, ratio: float) -> tuple[Response, Level]:
        """Answer a ratio as a run does, stability and all; return the response, and the level of the verdict on the case."""
        question = self.at(ratio)
        with JobJournal(Path(":memory:"), FORCED_RESPONSE.record) as journal:
            solve_job(FORCED_RESPONSE, Job(question.label, question), journal, frozenset())
            case = self.cases[self.ratios.index(ratio)]
            solved = Solved(case, journal.records(), journal.notes())
        verdict = FORCED_RESPONSE.dataset([solved])["case_verdict"].values[0]
        response = collect(question.problem, solved.records, question.model.peak_output)
        return response, LEVELS[int(verdict)]

    def stepped(
        self, ratio: float, hertz: tuple[float, float], selection: str, frequencies: int = 20
    ) -> tuple[ForcedProblem, list[ForcedPoint]]:
        """Return the response at equally spaced frequencies, without refinement of the peak."""
        load = self.load(ratio)
        sweep = Sweep(
            omega_range=(2 * np.pi * hertz[0], 2 * np.pi * hertz[1]),
            low=1,
            high=5,
            samples=self.sweep.samples,
            threshold=self.sweep.threshold,
            selection=selection,  # type: ignore[arg-type]  # one of the words, as text
            frequencies=frequencies,
            peak_points=0,
        )
        problem = forced_problem(self.system, load, sweep)
        return problem, list(forced_response(self.system, load, sweep))

    @property
    def rotation(self) -> int:
        """Dof of the damper's rotation about the axial direction."""
        return int(self.system.plain_structure.dof_set("damper")[4])

    @property
    def contact_dofs(self) -> IntArray:
        """Dofs of the blades at the contact points, along the excitation."""
        sides = ("blades.underside_1", "blades.underside_2")
        return np.concatenate([self.system.plain_structure.dof_set(s)[::3] for s in sides])

    @property
    def flat(self) -> IntArray:
        """Contacts of the damper's flat side."""
        return np.flatnonzero(np.array(self.question.model.contacts.groups) == "flat")


@lru_cache(maxsize=2)
def two_blades(coarser: float = 1.0, path: Path = STUDY, **values: Any) -> TwoBlades:
    """Mesh and reduce the example, once a process.

    Parameters
    ----------
    coarser
        Factor on the element sizes of the blades.
    path
        Another study of the same parts, points and loads.
    values
        Of other keys of the study, lists as tuples: ``**{"part.blades.flat_angle_deg": 50.0}``.
    """
    # what is compared here are the published passages
    changed: dict[str, Any] = {"harmonics.high": 5}
    changed |= {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}
    study = read_study(path)
    sizes = study.file.raw["part"]["blades"]
    changed |= {f"part.blades.{k}": coarser * sizes[k] for k in SIZES if k in sizes}
    study = study.replace(changed)
    cases = study.cases()
    ratios = tuple(float(case.values[RATIO]) for case in cases)
    return TwoBlades(question_of(cases[0], cases[0].build()), ratios, tuple(cases))
