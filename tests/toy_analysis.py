"""An analysis of a few lines, and studies of it: what the runner does is seen without a solver."""

import json
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from stickslip.errors import SingularError, input_error
from stickslip.study.analysis import Analysis, Case, Notes, Solved, TextTable
from stickslip.study.file.model.loads import Operation
from stickslip.study.file.model.strength import Stress
from stickslip.study.own_code import OwnCode
from stickslip.study.store.netcdf import stacked, variable
from stickslip.study.store.progress import LOG, advance
from stickslip.study.verdict import Verdict


@dataclass(frozen=True, eq=False)
class Term:
    """A record."""

    index: int
    value: np.ndarray
    process: int


def key(case: Case) -> str:
    return json.dumps({"terms": case.settings.toy.terms})


def inputs(case: Case, model: Any) -> dict[str, Any]:
    toy = case.settings.toy
    if toy.terms < 1:
        raise input_error("toy.terms", f"must be above zero, got {toy.terms}", "Give more.")
    kept = case.store(f"matrix {model.factor}", lambda: {"matrix": matrix(model.factor)})
    return {"factor": model.factor, "toy": toy, "checks": case.checks, **kept}


def solve(inputs: Any, done: Sequence[Term], notes: Notes) -> Iterator[Term]:
    toy, x = inputs["toy"], done[-1].value if done else np.ones(40)
    notes.put("model", {"factor": inputs["factor"]})
    for i in range(len(done), toy.terms):
        if i == toy.stop_at:
            stop(toy.how)
        x = inputs["matrix"] @ x
        advance((i + 1) / toy.terms, f"term {i}")
        yield Term(i, x, os.getpid())
    if "twice" in inputs["checks"] and notes.get("twice") is None:
        LOG.info("checked twice")
        notes.put("twice", {"off": 0.0})


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    return xr.Dataset(stacked([_of_case(s) for s in solved])).assign(
        case_label=("case", [s.case.label for s in solved])
    )


def verdicts(data: xr.Dataset) -> tuple[Verdict, ...]:
    large = data.case_label.values[data.factor.values > 2]
    return tuple(Verdict("doubtful", str(label), None, "large") for label in large)


def check(case: Case, model: Any) -> tuple[str, ...]:
    return (f"toy: {case.settings.toy.terms} terms",)


def summary(data: xr.Dataset) -> tuple[TextTable, ...]:
    return (TextTable("Toy", ("sum",), ((f"{float(data.value.sum()):.3g}",),)),)


def _of_case(solved: Solved) -> dict[str, xr.Variable]:
    found = {"factor": variable("", solved.notes["model"]["factor"], "1", "factor")}
    if "twice" in solved.notes:
        found["off"] = variable("", solved.notes["twice"]["off"], "1", "of the check")
    if solved.records:
        found["value"] = variable("term entry", [r.value for r in solved.records], "m", "value")
        found["process"] = variable("term", [r.process for r in solved.records], "1", "process")
    return found


def stop(how: str) -> None:
    if how == "interrupt":
        raise KeyboardInterrupt
    if how == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    raise SingularError("no equilibrium")


# powers of a matrix times a vector: the same bits wherever they are computed
TOY = Analysis(
    name="toy",
    table=SimpleNamespace,
    record=Term,
    key=key,
    inputs=inputs,
    solve=solve,
    dataset=dataset,
    check=check,
    summary=summary,
    checks=("twice",),
    verdicts=verdicts,
)


@dataclass(frozen=True, eq=False)
class ToyStudy:
    """A study of the toy: a case a factor."""

    path: Path
    factors: tuple[float, ...] = (1.5, 2.5)
    terms: int = 5
    stop_at: int = -1
    how: str = ""
    stop_in: int = 0
    title: str = "toy"
    text: str = "[toy]"
    asked: tuple[str, ...] = ("toy",)
    measured: None = None
    tables: Any = field(default_factory=lambda: SimpleNamespace(operation=Operation(), stress=Stress()))
    code: OwnCode = field(default_factory=OwnCode)
    built: list[float] = field(default_factory=list)

    @property
    def folder(self) -> Path:
        return self.path.parent / "results"

    def cases(self) -> list[Case]:
        return [self._case(i, f) for i, f in enumerate(self.factors)]

    def _case(self, index: int, factor: float) -> Case:
        stop_at = self.stop_at if index == self.stop_in else -1
        toy = SimpleNamespace(terms=self.terms, stop_at=stop_at, how=self.how)
        build: Callable[[], Any] = partial(self._build, factor)
        values = {"factor": factor}
        return Case(
            index, f"factor = {factor:g}", values, SimpleNamespace(toy=toy), build, str(factor), self.path.parent
        )

    def _build(self, factor: float) -> Any:
        self.built.append(factor)
        return SimpleNamespace(factor=factor, parts={})


def matrix(factor: float) -> np.ndarray:
    return factor * np.random.default_rng(7).standard_normal((40, 40)).T / 7
