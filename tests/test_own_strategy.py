"""A strategy of a user, given to a model as an object: its answer, its name on the page, what does not go with it."""

import sys
from pathlib import Path
from typing import Any

import pytest

import stickslip as ss
from stickslip.analyses.page import report_html

pytestmark = pytest.mark.usefixtures("peak_alone")

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="module")
def model() -> ss.Model:
    return ss.Study.from_file(EXAMPLES / "four_masses" / "study.toml").model()


@pytest.fixture
def own(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(EXAMPLES)
    from own_strategy import Unbalanced

    monkeypatch.delitem(sys.modules, "own_strategy", raising=False)
    return Unbalanced


def test_a_strategy_of_a_user_answers_as_all_harmonics_do_and_is_named(model: ss.Model, own: Any) -> None:
    few: dict[str, Any] = {"high": 9, "points": 12, "peak_points": 4, "stability": "off"}
    chosen = model.forced_response((8.0, 16.0), selection=own(), **few)
    every = model.forced_response((8.0, 16.0), selection="always_high", **few)
    size = [float(one["forced_response"].peak_amplitude.values[0]) for one in (chosen, every)]
    assert size[0] == pytest.approx(size[1], rel=0.02)  # it leaves out forces below 2 % of the excitation
    data = chosen["forced_response"]
    assert data.attrs["selection"] == "Unbalanced"
    assert "Unbalanced" in report_html(chosen.data)
    assert ss.compare(chosen, every, names=("own", "all")).peaks["design"].tolist() == ["own", "all"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"strategy_threshold": 2.0}, "has no meaning for the strategy Unbalanced"),
        ({"alert_threshold_percent": 2.0}, "has no meaning for the strategy Unbalanced"),
        ({"per_dof": True}, "Remove it, or choose one of grolet, maple"),
    ],
)
def test_keys_of_named_strategies_do_not_go_with_an_own_one(
    model: ss.Model, own: Any, given: dict[str, Any], said: str
) -> None:
    with pytest.raises(ss.InputError, match=said):
        model.forced_response((8.0, 16.0), high=9, selection=own(), **given)


def test_a_class_is_refused_for_its_instance(model: ss.Model, own: Any) -> None:
    with pytest.raises(ss.InputError, match=r"is the class Unbalanced. Make one: Unbalanced\(\)"):
        model.forced_response((8.0, 16.0), high=9, selection=own)
