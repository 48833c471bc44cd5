"""A strategy of a user's own that cannot work is refused with its name, before or at its first verdict."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import stickslip as ss
from evidence.models.lumped import griffin
from stickslip.errors import InputError, SingularError
from stickslip.harmonic.selection.jacobian_alert import JacobianAlert
from stickslip.harmonic.selection.strategy import Verdict, judged
from stickslip.response.forced.response import Sweep, forced_response

RANGE = (0.9, 1.3)


@dataclass(frozen=True)
class Own:
    answer: object
    verifies: ClassVar[bool] = True
    threshold: float = 0.05

    def judge(self, _):
        return self.answer


class NoThreshold:
    verifies = True

    def judge(self, _):
        raise AssertionError


class NoVerifies:
    threshold = 0.05

    def judge(self, _):
        raise AssertionError


class Undecided(Own):
    verifies = None


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (JacobianAlert, r"is the class JacobianAlert\. Make one: JacobianAlert\(\)"),
        (3.0, "is a float, which has no method judge"),
        (NoThreshold(), r"NoThreshold\.threshold: is missing"),
        (NoVerifies(), r"NoVerifies\.verifies: is missing\. True: a verdict says how good"),
        (Own(None, threshold=float("nan")), r"Own\.threshold: is nan"),
        (Undecided(None), r"Undecided\.verifies: is neither True nor False"),
    ],
)
def test_what_cannot_be_asked_is_refused_at_once(wrong, message):
    with pytest.raises(InputError, match=message):
        Sweep(omega_range=RANGE, selection=wrong)


@pytest.mark.parametrize("passages", ["double", "single"])
@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (0.3, r"Own\.judge: returned a float\. Return a Verdict"),
        (
            Verdict(float("nan"), None, (0, 1)),
            r"Own\.judge: returned the indicator nan\. Return a finite number: above",
        ),
        (Verdict(float("inf"), None, (0, 1)), r"Own\.judge: returned the indicator inf"),
        (Verdict("loud", None, (0, 1)), r"Own\.judge: returned the indicator 'loud'"),
        (
            Verdict(1.0, 3, (0, 1)),
            r"Own\.judge: returned again = 3\. Return a tuple of harmonics, .* or None: accepted\.",
        ),
        (Verdict(1.0, np.ones((2, 2), bool), (0, 1)), r"returned again = an array of shape \(2, 2\)\. Return a tuple"),
        (Verdict(0.0, None, None), r"Own\.judge: returned following = None\. Return a tuple of harmonics, such as \(0"),
        (
            Verdict(1.0, (0, 1, 3), (0, 1), np.zeros(3)),
            r"returned start = an array of shape \(3,\)\. Return an array of",
        ),
        (Verdict(1.0, (0, 1, 9), (0, 1)), "asks for harmonics 9, which the reference does not"),
        (Verdict(0.0, None, (0, 1, 7)), "asks for harmonics 7, which the reference does not"),
    ],
)
def test_verdicts_that_cannot_be_followed_are_refused(answer, message, passages):
    sweep = Sweep(omega_range=RANGE, selection=Own(answer), passages=passages, frequencies=4)
    with pytest.raises(InputError, match=message):
        list(forced_response(*griffin(0.1), sweep))


class Solves(Own):
    def judge(self, _):
        return np.linalg.solve(np.array(1.0), np.ones(1))  # no matrix: an error of its own, not of the balance


class NoStep(Own):
    def judge(self):
        raise AssertionError


class OfThePackage(Own):
    def judge(self, _):
        raise SingularError("dof x")


@pytest.mark.parametrize(
    ("strategy", "message", "cause"),
    [
        (
            Solves(None),
            r"Solves\.judge: raises LinAlgError: .* See test_strategy_checks\.py, line \d+",
            np.linalg.LinAlgError,
        ),
        (NoStep(None), r"NoStep\.judge: raises TypeError: .* Let it take \(self, step\)", TypeError),
    ],
)
def test_what_a_strategy_raises_names_it_and_its_line(strategy, message, cause):
    with pytest.raises(InputError, match=message) as told:
        judged(strategy, None)
    assert isinstance(told.value.__cause__, cause)


def test_errors_of_the_package_go_through_a_strategy():
    with pytest.raises(SingularError, match="dof x"):
        judged(OfThePackage(None), None)


def test_a_model_tells_what_its_strategy_raises():
    chain = ss.model.lumped(np.eye(1), np.eye(1), 0.02 * np.eye(1), names=("x",))
    damper = ss.Contact(between=("c.x", "ground"), law=ss.Jenkins(k_t=0.5, limit=0.035), acts="tangential")
    loads = {"shaker": ss.Load(on="c.x", newton=0.1)}
    model = ss.Model(parts={"c": ss.Part(structure=chain)}, contacts={"damper": damper}, loads=loads)
    with pytest.raises(InputError, match=r"Solves\.judge: raises LinAlgError"):
        model.forced_response((0.02, 0.1), high=3, points=3, peak_points=0, stability="off", selection=Solves(None))
