"""B7: the Jacobian Alert on the blade-damper-blade system: what it predicts against the real error, with its known counter-example."""

import numpy as np

from evidence.models.lumped import blades_and_damper
from evidence.validation.compare import Record, bound, digits, record
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.response.forced.response import (
    ForcedPoint,
    ForcedProblem,
    Sweep,
    accepted_points,
    forced_problem,
    forced_response,
)

SOURCE = "literature benchmark B7"
LINEAR = (150, 155, 165, 170, 180, 200)
TABLE = (  # Hz, |y2| at H=1, at H=5, predicted %, real %
    ("159", "1.328498e-4", "1.328579e-4", "0.0070", "0.0070"),
    ("160", "1.986549e-4", "2.000666e-4", "0.5494", "1.1109"),
    ("161", "2.510039e-4", "2.191934e-4", "15.310", "13.934"),
    ("162", "2.588833e-4", "2.251094e-4", "33.398", "14.375"),
    ("163", "2.413643e-4", "2.273523e-4", "1.1485", "7.280"),
    ("164", "1.906946e-4", "1.896742e-4", "0.6292", "0.6320"),
    ("220", "5.295838e-5", "5.356967e-5", "2.2010", "1.9525"),
    ("222", "4.881372e-5", "4.928118e-5", "1.3698", "1.1710"),
    ("228", "3.668326e-5", "3.727022e-5", "2.4511", "2.1940"),
    ("230", "3.258035e-5", "3.307679e-5", "3.2280", "2.9631"),
)
HARDER = (  # force factor 1.5: Hz, predicted %, real %
    ("158", "0.7278", "0.5905"),
    ("159", "19.60", "23.28"),
    ("160", "36.37", "26.92"),
    ("166", "0.0040", "0.0041"),
    ("168", "0.0000", "0.0000"),
    ("215", "8.164", "5.982"),
    ("235", "4.211", "4.038"),
)


def both_passages(hertz: float, factor: float = 1.0) -> tuple[ForcedProblem, ForcedPoint, ForcedPoint]:
    """Solve at H = 1 and repeat at H = 5 whatever the alert says."""
    problem, load = blades_and_damper(excitation=factor)
    sweep = Sweep(
        omega_range=(2 * np.pi * (hertz - 0.5), 2 * np.pi * hertz),
        high=5,
        selection="jacobian_alert",  # as published, of which the table speaks
        threshold=-1.0,
        frequencies=5,
        peak_points=0,
        evaluator="intervals",  # on samples, as the published numbers
    )
    points = list(forced_response(problem, load, sweep))
    last = max(p.index for p in points)
    low, high = (next(p for p in points if p.stage == stage and p.index == last) for stage in ("low", "high"))
    return forced_problem(problem, load, sweep), low, high


def real_error(problem: ForcedProblem, low: ForcedPoint, high: ForcedPoint) -> float:
    """Return the largest relative change of the first harmonic over the blade dofs, as the benchmark defines it."""
    first, full = (problem.low.linear.recover(p.omega, p.coefficients)[1, :4] for p in (low, high))
    return float(np.max(np.abs(full - first) / np.abs(first)))


def two_forms(hertz: float) -> float:
    """Return how far eq. 21 of the paper, J (q + dq) = F, is from the Newton step, relative to the motion."""
    problem, low, _ = both_passages(hertz)
    x = problem.low.unknowns(low.coefficients)
    newton = jacobian_alert(problem.low, problem.high, x, low.omega, problem.measure).start
    at = problem.high.linearise(problem.high.unknowns(low.coefficients), low.omega)
    # at q = 0 nothing slips or opens for want of a preload: the residual there is minus the load
    load = -problem.high.linearise(np.zeros(problem.high.size), low.omega).residual
    published = np.linalg.solve(at.jac, load)
    return float(np.max(np.abs(published - newton)) / np.max(np.abs(newton)))


def crossing() -> list[ForcedPoint]:
    """Follow the branch of H = 1 from 221 to 229 Hz by arc length."""
    sweep = Sweep(
        omega_range=(2 * np.pi * 221, 2 * np.pi * 229), selection="always_low", peak_points=0, evaluator="intervals"
    )
    return accepted_points(list(forced_response(*blades_and_damper(), sweep)))


def run() -> list[Record]:
    """Compare both tables row by row."""
    case = "B7 Jacobian Alert"
    records = []
    for hertz in LINEAR:
        problem, low, high = both_passages(float(hertz))
        records += [
            bound(case, f"predicted error at {hertz} Hz", low.predicted_error, 1e-10, SOURCE),
            bound(case, f"real error at {hertz} Hz", real_error(problem, low, high), 1e-10, SOURCE),
        ]
    for hertz, first, fifth, predicted, real in TABLE:
        problem, low, high = both_passages(float(hertz))
        note = ", known limit of the method" if hertz == "163" else ""
        records += [
            digits(case, f"|y2| at {hertz} Hz, H = 1, m", problem.amplitude(low), first, SOURCE),
            digits(case, f"|y2| at {hertz} Hz, H = 5, m", problem.amplitude(high), fifth, SOURCE),
            digits(case, f"predicted error at {hertz} Hz, %{note}", 100 * low.predicted_error, predicted, SOURCE),
            digits(case, f"real error at {hertz} Hz, %{note}", 100 * real_error(problem, low, high), real, SOURCE),
        ]
    for hertz, predicted, real in HARDER:
        problem, low, high = both_passages(float(hertz), 1.5)
        at = f"at {hertz} Hz, force factor 1.5, %"
        records += [
            digits(case, f"predicted error {at}", 100 * low.predicted_error, predicted, SOURCE),
            digits(case, f"real error {at}", 100 * real_error(problem, low, high), real, SOURCE),
        ]
    records += [
        bound(case, f"eq. 21 against the Newton form at {hertz} Hz", two_forms(float(hertz)), 1e-10, SOURCE)
        for hertz in (160, 162, 163, 220)
    ]
    points = crossing()
    records += [
        record(
            case,
            "share of converged points, 221 to 229 Hz by arc length",
            np.mean([p.converged for p in points]),
            1.0,
            0.0,
            SOURCE,
        ),
        record(
            case, "end of the branch followed through the gap, Hz", points[-1].omega / 2 / np.pi, 229.0, 1e-12, SOURCE
        ),
    ]
    return records
