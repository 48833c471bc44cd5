"""What the alert predicts against what happens: the tables of the page on harmonic selection, computed when the page is built."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import stickslip as ss
from stickslip.harmonic.selection.alert import jacobian_alert

Case = tuple[ss.System, ss.HarmonicLoad]
HERTZ = 2 * np.pi


@dataclass(frozen=True)
class Pair:
    """A frequency solved with few harmonics and with many."""

    problem: ss.response.ForcedProblem
    few: ss.response.ForcedPoint
    many: ss.response.ForcedPoint

    def predicted(self, form: str = "newton", harmonics: tuple[int, ...] | None = None) -> float:
        """Return the predicted error in percent."""
        problem = self.problem
        high = problem.high if harmonics is None else problem.high.with_harmonics(harmonics)
        x = problem.low.unknowns(self.few.coefficients)
        arguments = (problem.low, high, x, self.few.omega, problem.measure)
        return 100 * jacobian_alert(*arguments, form=form).error

    @property
    def real(self) -> float:
        """The error in percent."""
        return 100 * self.problem.real_error(self.few, self.many)


def oscillator(law: object, row: int = 0, third: float = 0.0) -> Case:
    """Return one mass (m = k = 1, c = 0.02) under a force of 0.1, and one of `third` at thrice the frequency."""
    gap = np.zeros((3, 1))
    gap[row] = 1.0
    structure = ss.model.lumped(np.eye(1), np.eye(1), 0.02 * np.eye(1))
    forces = {1: np.array([0.1 + 0j])} | ({3: np.array([1j * third])} if third else {})
    system = ss.System(structure, ss.Interface(("c",), (law,), gap), outputs=np.array([0]))
    return system, ss.HarmonicLoad(np.zeros(1), forces)


def blades(preload: float = 0.0) -> Case:
    """Return blade, damper, blade (B6 of the validation) with a preload in each contact, N."""
    stiffness = np.diag([3e5] * 4 + [0.0, 0.0])
    for a, b, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
        stiffness[[a, b], [a, b]] += k
        stiffness[[a, b], [b, a]] -= k
    structure = ss.model.lumped(np.array([1.0, 1, 1, 1, 0.1, 0.1]), stiffness, np.diag([20.0, 20, 20, 20, 0, 0]))
    cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
    gap = np.zeros((6, 6))
    for contact, (blade, turn) in enumerate(((0, sin), (2, -sin))):
        local = np.array([[cos, turn], [turn, -cos]])
        gap[[3 * contact, 3 * contact + 2], 4:] = local
        gap[[3 * contact, 3 * contact + 2], blade : blade + 2] = -local
    law = ss.ElasticCoulomb(k_t=3e5, k_w=0.0, k_n=3e5, mu=0.5, preload=preload, residual_traction=0.0)
    interface = ss.Interface(("left", "right"), (law, law), gap)
    system = ss.System(structure, interface, np.arange(4), free=np.array([4, 5]))
    static = np.array([0, 0, 0, 0, 0, 120.0])
    return system, ss.HarmonicLoad(static, {1: -1j * np.array([0, -20.0, 5, 0, 0, 0])})


def row_of_masses() -> Case:
    """Return twenty masses in a row, the first six of which rub against ground (sliders of constant limit)."""
    gap = np.zeros((18, 20))
    gap[3 * np.arange(6), np.arange(6)] = 1.0
    force = np.zeros(20, dtype=complex)
    force[-1] = 12.0
    names = tuple(f"element{i}" for i in range(6))
    interface = ss.Interface(names, (ss.Jenkins(k_t=2e3, limit=10.0),) * 6, gap)
    system = ss.System(ss.model.chain(20, 1.0, 1e4, 2e-3), interface, outputs=np.array([19]))
    return system, ss.HarmonicLoad(np.zeros(20), {1: force})


def pairs(
    case: Case,
    omega_range: tuple[float, float],
    count: int,
    low: int | tuple[int, ...] = 1,
    high: int | tuple[int, ...] = 5,
) -> list[Pair]:
    """Solve equally spaced frequencies with few harmonics and with many, whatever the alert says."""
    sweep = ss.Sweep(
        omega_range=omega_range,
        low=low,
        high=high,
        selection=ss.harmonic.JacobianAlert(threshold=-1.0),
        frequencies=count,
        peak_points=0,
    )
    points = list(ss.forced_response(*case, sweep))
    problem = ss.response.forced_problem(*case, sweep)
    again = {p.index: p for p in points if p.stage == "high" and p.converged}
    few = [p for p in points if p.stage == "low" and p.converged and p.index in again]
    return [Pair(problem, p, again[p.index]) for p in few]


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def number(percent: float) -> str:
    """Return a percentage with two figures, or as a whole number."""
    return f"{percent:.0f}" if percent >= 100 else f"{percent:.2g}"


def forms() -> str:
    """Return both forms against the real error, from one harmonic to five."""
    cases: list[tuple[str, Case, tuple[float, float], Callable[[float], str]]] = [
        ("two blades, friction under a variable normal load", blades(), (160 * HERTZ, 164 * HERTZ), hertz),
        ("the same with 20 N of preload in each contact", blades(20.0), (227 * HERTZ, 228 * HERTZ), hertz),
        ("slider of constant limit 0.1, $k = 0.5$", oscillator(ss.Jenkins(k_t=0.5, limit=0.1)), (1.05, 1.25), plain),
        (
            "stop behind a gap of 0.3, $k = 0.5$",
            oscillator(ss.UnilateralSpring(k_n=0.5, initial_gap=0.3), 2),
            (0.9, 1.0),
            plain,
        ),
        (
            "support pressed by 0.1 N, $k = 1$",
            oscillator(ss.UnilateralSpring(k_n=1.0, preload=0.1), 2),
            (1.3, 1.5),
            plain,
        ),
        ("cubic spring $g^3$", oscillator(ss.CubicSpring(cubic_t=1.0)), (0.7, 0.9), plain),
    ]
    rows = []
    for name, case, span, unit in cases:
        for pair in pairs(case, span, 2):
            errors = pair.predicted(), pair.predicted("published"), pair.real
            rows.append((name, unit(pair.few.omega), *map(number, errors)))
    return table(("case", "frequency", "Newton, %", "eq. 21, %", "real, %"), rows)


def hertz(omega: float) -> str:
    """Return a frequency in Hz."""
    return f"{omega / HERTZ:g} Hz"


def plain(omega: float) -> str:
    """Return a frequency in rad/s."""
    return f"{omega:g} rad/s"


def supports() -> str:
    """Return what the alert says towards odd harmonics and towards all."""
    rows = []
    every = (0, 1, 2, 3, 4, 5)
    cases = [
        ("20 masses, 6 sliders", row_of_masses(), (7.0, 7.75), plain, 1, (1, 3, 5)),
        ("two blades", blades(), (160 * HERTZ, 162 * HERTZ), hertz, 1, (1, 3, 5)),
        ("two blades", blades(), (160 * HERTZ, 162 * HERTZ), hertz, (1, 3, 5), 5),
    ]
    for name, case, span, unit, low, high in cases:
        few = "1" if low == 1 else "1, 3, 5"
        exact = {p.few.omega: p.real for p in pairs(case, span, 3, low, every)}
        for pair in pairs(case, span, 3, low, high):
            odd = "" if high == 5 else number(pair.predicted())
            real = exact.get(pair.few.omega)
            rows.append(
                (
                    name,
                    few,
                    unit(pair.few.omega),
                    odd,
                    number(pair.predicted(harmonics=every)),
                    "" if real is None else number(real),
                )
            )
    head = ("case", "solved with", "frequency", "towards 1, 3, 5, %", "towards 1 to 5, %", "real, %")
    return table(head, rows)


def several() -> str:
    """Return the error of a solution under harmonics 1 and 3 of the load."""
    case = oscillator(ss.Jenkins(k_t=0.5, limit=0.1), third=0.05)
    rows = []
    for pair in pairs(case, (0.4, 1.3), 10, (1, 3), (1, 3, 5, 7, 9, 11, 13, 15)):
        if pair.real > 1e-3:
            x = pair.problem.low.unknowns(pair.few.coefficients)
            alert = jacobian_alert(pair.problem.low, pair.problem.high, x, pair.few.omega, pair.problem.measure)
            rows.append((plain(pair.few.omega), str(alert.harmonic), f"{100 * alert.error:.3f}", f"{pair.real:.3f}"))
    return table(("frequency", "harmonic", "predicted, %", "real, %"), rows)


def reference() -> str:
    """Return what ten harmonics would change of a response with the alert from one to five."""
    case = blades()
    shared = {"omega_range": (159 * HERTZ, 164 * HERTZ), "frequencies": 11, "peak_points": 0}
    sweep = ss.Sweep(high=5, selection="jacobian_alert", **shared)
    points = ss.response.accepted_points(list(ss.forced_response(*case, sweep)))
    problem = ss.response.forced_problem(*case, sweep)
    ten = list(ss.forced_response(*case, ss.Sweep(low=10, high=10, selection="always_low", **shared)))
    exact = {p.omega: p for p in ten}
    rows = []
    for check, point in zip(ss.response.check_support(problem, points), points, strict=True):
        real = 100 * problem.real_error(point, exact[point.omega])
        rows.append((hertz(check.omega), str(check.kept[-1]), number(100 * check.error), number(real), check.label))
    return table(("frequency", "harmonics kept", "predicted, %", "real, %", "dof"), rows)


def alert_tables() -> dict[str, str]:
    """Return the tables by the name of their file."""
    return {
        "alert_forms.md": forms(),
        "alert_supports.md": supports(),
        "alert_several.md": several(),
        "alert_reference.md": reference(),
    }
