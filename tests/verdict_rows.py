"""Cases of results made of plain numbers, for tests of what is said of them: no model is solved."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from stickslip.study.verdict import Verdict

Case = dict[str, xr.Variable]
NAN, INF = np.nan, np.inf


def above(value: float) -> float:
    """Return the next number."""
    return float(np.nextafter(value, INF))


def case_of(values: Mapping[str, Any], changes: Mapping[str, Any]) -> Case:
    """Return variables of a case; what is changed to None is not there."""
    every = {name: value for name, value in {**values, **changes}.items() if value is not None}
    return {
        name: xr.Variable([f"d{k}" for k in range(np.ndim(value))], np.asarray(value)) for name, value in every.items()
    }


def said(verdicts: list[Verdict] | tuple[Verdict, ...]) -> list[tuple[str, str]]:
    """Return the word of each verdict, and its sentence as it stands behind the label of a case."""
    return [(v.word, v.sentence[:1].lower() + v.sentence[1:]) for v in verdicts]


def check(verdicts: list[Verdict] | tuple[Verdict, ...], expected: list[tuple[str, ...]]) -> None:
    """Assert that verdicts are as many as expected ones, with their words, and hold each piece of their sentences."""
    found = said(verdicts)
    assert [word for word, _ in found] == [word for word, *_ in expected], found
    for (_, sentence), (_, *pieces) in zip(found, expected, strict=True):
        for piece in pieces:
            assert piece in sentence, (piece, sentence)
