"""What a model says of arguments that it cannot use."""

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr
from synthetic_result import tree_of

import stickslip as ss
from stickslip.api.figures import plotted


class Empty:
    pass


class Bare:
    kernel, pairs = None, 5

    def parameters(self) -> None: ...
    def initial_state(self) -> None: ...
    def stuck_stiffness(self) -> None: ...


def model(law: object = None) -> ss.Model:
    chain = ss.model.lumped(np.eye(1), np.eye(1), 0.02 * np.eye(1), names=("x",))
    used = ss.Jenkins(k_t=0.5, limit=0.035) if law is None else law
    damper = ss.Contact(between=("c.x", "ground"), law=used, acts="tangential")  # type: ignore[arg-type]
    return ss.Model(
        parts={"c": ss.Part(structure=chain)},
        contacts={"damper": damper},
        loads={"shaker": ss.Load(on="c.x", newton=0.1)},
    )


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("jenkins", r"contact\.damper\.law: is the text 'jenkins'\. Give a law with its parameters"),
        (ss.Jenkins, r"contact\.damper\.law: is the class Jenkins\. Make one: Jenkins\(\.\.\.\)"),
        (
            Empty(),
            r"contact\.damper\.law: is a Empty, which has no kernel, pairs, parameters, initial_state, stuck_stiff",
        ),
        (Bare(), r"contact\.damper\.law: is a Bare, which is no dataclass"),
    ],
)
def test_what_is_no_law_is_refused_by_contact_and_member(law: object, message: str) -> None:
    with pytest.raises(ss.InputError, match=message):
        model(law)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"hz": 10}, r"forced_response: hz: is one number, 10\. Give a range: hz=\(8, 16\)"),
        ({"hz": "ab"}, r"forced_response: hz: is 'ab', which holds no numbers"),
        ({"harmonics": 5}, r"forced_response: harmonics: is a table .* harmonics\.high: high=5"),
        ({"solver": {"evaluator": "aft"}}, r"forced_response: solver: is a table .* alone: evaluator=…"),
        ({"selection": Empty()}, r"is a Empty, which has no method judge\. Give it judge\(self, step\)"),
    ],
)
def test_what_is_no_argument_is_refused_with_a_remedy(given: dict[str, object], message: str) -> None:
    with pytest.raises(ss.InputError, match=message):
        model().forced_response(**{"hz": (0.02, 0.1), **given})  # type: ignore[arg-type]


def test_a_figure_is_no_axes() -> None:
    drawn = pytest.importorskip("matplotlib.figure")
    page = {"response": go.Figure(go.Scatter(x=[1.0, 2.0], y=[1.0, 3.0]))}
    figure = drawn.Figure()
    axes = figure.add_subplot()
    for wrong, name in ((figure, "Figure"), ([3], "int")):
        with pytest.raises(ss.InputError, match=rf"ax=…\): holds a {name}\. Give one pair of axes of matplotlib"):
            plotted(page, "response", wrong, "matplotlib", None, "result")
    assert plotted(page, "response", axes, "matplotlib", None, "result") is axes


def test_peaks_of_a_result_without_any_name_the_table() -> None:
    found = ss.Result(tree_of(nonlinear_mode=xr.Dataset({"amplitude": ("point", [1.0])})))
    with pytest.raises(
        ss.InputError, match=r"result\.peaks: .* nonlinear_mode\. Take result\.to_dataframe\('nonlinear_mode'\)"
    ):
        _ = found.peaks
