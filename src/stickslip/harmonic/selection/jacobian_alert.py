"""The Jacobian Alert as published.

C. Gastaldi and T.M. Berruti, Int. J. Non-Linear Mechanics 92 (2017) 25-40, section 4.
"""

from dataclasses import dataclass
from typing import ClassVar

from stickslip.harmonic.selection.alert import Form, check_form, jacobian_alert
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class JacobianAlert:
    """Repeat with all harmonics of the reference if the predicted error exceeds a threshold.

    Parameters
    ----------
    threshold
        Largest predicted error that is accepted, as a fraction.
    form
        Prediction of the error: one ``newton`` step in the enlarged space, or eq. 21 as ``published``. They are equal
        if contact forces are homogeneous of degree one.

    Raises
    ------
    InputError
        If the form is unknown.
    """

    verifies: ClassVar[bool] = True
    threshold: float = 0.05
    form: Form = "newton"

    def __post_init__(self) -> None:
        check_form(self.form)

    def judge(self, step: Step) -> Verdict:
        """Predict the change by all harmonics of the reference."""
        high = step.reference
        if step.balance.harmonics == high.harmonics:
            return Verdict(0.0, None, step.smallest)
        alert = jacobian_alert(step.balance, high, step.x, step.omega, step.measure, step.solve, self.form, step.events)
        again = high.harmonics if alert.error > self.threshold else None
        return Verdict(alert.error, again, step.smallest, high.coefficients(alert.start))
