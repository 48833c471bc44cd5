"""Names of the methods that evaluate contact forces over a period."""

from typing import Literal, get_args

from stickslip.errors import check_choice

Evaluator = Literal["intervals", "march", "events"]


def check_evaluator(evaluator: str) -> None:
    """Refuse an unknown evaluator."""
    check_choice("evaluator", evaluator, get_args(Evaluator), "'events' has no sampling error.")
