"""Joining of job records: arrays, cases side by side, verdicts."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.columns import variables
from stickslip.analyses.facts import ModelFacts, facts_in
from stickslip.study.analysis import Solved
from stickslip.study.store.netcdf import alike, one_case, stacked
from stickslip.study.verdict import ATTRIBUTE, Verdict, of_all_cases, to_json


def of_answers(
    solved: Sequence[Solved],
    answer: Callable[[Solved], Any],
    verdicts: Callable[[str, Any], Iterable[Verdict]],
    lost: Callable[[Any], int] = lambda _: 0,
) -> xr.Dataset:
    """Return the node of all cases.

    Parameters
    ----------
    solved
        Content of the jobs.
    answer
        Returns the record of a case.
    verdicts
        Returns the verdicts on a case from its label and its record.
    lost
        Returns the number of its points without a solution.
    """
    answers = [answer(one) for one in solved]
    labels = [one.case.label for one in solved]
    models = [variables(ModelFacts(**facts_in(one.notes))) for one in solved]
    cases = [model | variables(own) for model, own in zip(models, answers, strict=True)]
    found = [v for label, own in zip(labels, answers, strict=True) for v in verdicts(label, own)]
    attributes = {ATTRIBUTE: to_json(of_all_cases(found, labels)), "failed": sum(map(lost, answers))}
    return xr.Dataset(stacked(cases), attrs=attributes)


def told_apart(data: xr.Dataset) -> Iterator[tuple[xr.Dataset, str]]:
    """Yield equal cases once, with their labels as heading of the tables; the heading is empty if all cases are equal."""
    groups = alike(data)
    for group in groups:
        labels = [str(data["case_label"].values[i]) for i in group if len(groups) > 1]
        yield one_case(data, group[0]), f"{'; '.join(labels)}: " if labels else ""


def number(value: float, digits: int = 5) -> str:
    """Return a number for a table, with a dash for none."""
    return f"{value:.{digits}g}" if np.isfinite(value) else "-"
