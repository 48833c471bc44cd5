"""What a run will cost, told before it starts."""

from dataclasses import dataclass

from stickslip.errors import input_error
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.study.schema import Study

BYTES_A_NODE = 35e3  # assembly and factorisation of second-order tetrahedra, measured at 10 to 30 thousand nodes
BASE_GB = 0.35  # interpreter and libraries
POINTS = 1.7  # points of a branch for each one asked: more are taken where the response turns
NEWTON_A_POINT = 10  # the example took 7, repeats and failed tries included
REPEATED = 0.6  # share of points that a strategy solves with many harmonics
FLOPS = 2e9  # of a Newton step: a small dense factorisation on one core, and the contacts
SECONDS_A_NODE = 1.2e-3  # assembly, reduction and the full model's frequencies
RETAINED = 6  # damper coordinates beside three a contact


@dataclass(frozen=True)
class Estimate:
    """Cost of a run.

    Parameters
    ----------
    nodes
        Of the mesh of both blades.
    memory_gb
        Largest memory.
    newton_steps
        Of all load cases.
    seconds
        Of one core: model and solver together, without time integration.
    """

    nodes: int
    memory_gb: float
    newton_steps: int
    seconds: float

    def __str__(self) -> str:
        return (
            f"estimate: {self.nodes} nodes, {self.memory_gb:.1f} GB of memory, {self.newton_steps} Newton steps, "
            f"{self.seconds:.0f} s"
        )


def estimate(study: Study, nodes: int) -> Estimate:
    """Estimate memory and work of `study` on a mesh of `nodes` nodes."""
    t = study.tables
    coordinates = 9 * len(t.damper.sections_m) + RETAINED
    h = t.harmonics
    grid = t.sweep.frequencies or (t.sweep.points if h.single else POINTS * t.sweep.points)
    points = len(t.loads.ratios) * (grid + t.sweep.peak_points)
    kept = always_kept(h.strategy)
    share_high = {"low": 0.0, "high": 1.0, None: REPEATED}[kept]
    low, high = ((2 * len(own) - 1) * coordinates for own in (h.low_harmonics, h.high_harmonics))
    # each strategy looks at the larger space about once a point
    judged = points if kept is None else 0
    steps_high = points * share_high * NEWTON_A_POINT + judged
    steps_low = points * NEWTON_A_POINT if kept != "high" else 0
    seconds = (steps_low * low**3 + steps_high * high**3) * 4 / FLOPS + nodes * SECONDS_A_NODE
    stored = points * (h.high_harmonics[-1] + 1) * 10 * coordinates * 16 / 1e9
    memory = BASE_GB + nodes * BYTES_A_NODE / 1e9 + stored + 6 * high**2 * 8 / 1e9
    return Estimate(nodes, memory, round(steps_low + steps_high), seconds)


def check_limits(study: Study, cost: Estimate) -> None:
    """Refuse a run that is estimated above the study's limits.

    Raises
    ------
    InputError
        Naming the limit.
    """
    limits = study.tables.limits
    advice = "Take a coarser mesh, fewer points, ratios or harmonics, or raise the limit."
    if cost.memory_gb > limits.memory_gb:
        raise input_error(
            f"{study.path}: limits.memory_gb",
            f"the run is estimated at {cost.memory_gb:.1f} GB ({cost.nodes} nodes), the limit is {limits.memory_gb:g} GB",
            advice,
        )
    if cost.seconds > limits.work_s:
        raise input_error(
            f"{study.path}: limits.work_s",
            f"the run is estimated at {cost.seconds:.0f} s ({cost.newton_steps} Newton steps), the limit is "
            f"{limits.work_s:g} s",
            advice,
        )
