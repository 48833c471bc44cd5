"""A strategy of a user's own that cannot work is refused with its name, before or at its first verdict."""

from dataclasses import dataclass
from typing import ClassVar

import pytest

from evidence.models.lumped import griffin
from stickslip.errors import InputError
from stickslip.harmonic.selection.jacobian_alert import JacobianAlert
from stickslip.harmonic.selection.strategy import Verdict
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


class Undecided(Own):
    verifies = None


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (JacobianAlert, r"is the class JacobianAlert\. Make one: JacobianAlert\(\)"),
        (3.0, "is a float, which has no method judge"),
        (NoThreshold(), r"NoThreshold\.threshold: is None"),
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
        (Verdict(1.0, (0, 1, 9), (0, 1)), "asks for harmonics 9, which the reference does not"),
        (Verdict(0.0, None, (0, 1, 7)), "asks for harmonics 7, which the reference does not"),
    ],
)
def test_verdicts_that_cannot_be_followed_are_refused(answer, message, passages):
    sweep = Sweep(omega_range=RANGE, selection=Own(answer), passages=passages, frequencies=4)
    with pytest.raises(InputError, match=message):
        list(forced_response(*griffin(0.1), sweep))
