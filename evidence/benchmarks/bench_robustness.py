"""Share of points of random small systems that converge, in a run short enough to stand beside the others; the whole one is `robustness`."""

from collections import Counter
from typing import Any

from evidence.benchmarks.robustness import GOAL, Outcome, outcome
from evidence.models.random_machines import has_planes

SYSTEMS = 40
PLANAR = 20  # of them, with planar friction where they have planes
PLANAR_GOAL = 0.995
SEED = 7


def converged(outcomes: list[Outcome]) -> tuple[float, str]:
    """Return the share of points that converged, and failed ones of all points in each family."""
    points, failed = sum(o.points for o in outcomes), sum(o.failed for o in outcomes)
    said = []
    for family in sorted({o.family for o in outcomes}):
        own = [o for o in outcomes if o.family == family]
        said.append(f"{family} {sum(o.failed for o in own)} of {sum(o.points for o in own)}")
    return 1.0 - failed / points, f"{', '.join(said)} points failed of {len(outcomes)} systems"


def planar(two_springs: list[Outcome]) -> list[dict[str, Any]]:
    """Sweep the same systems with planar friction."""
    same = [o for o in two_springs[:PLANAR] if has_planes(SEED, o.number)]
    share, said = converged([outcome(SEED, o.number, planar=True) for o in same])
    of_springs, springs_said = converged(same)
    return [
        {
            "name": "planar/converged_share",
            "value": share,
            "goal": f">= {PLANAR_GOAL}",
            "holds": share >= PLANAR_GOAL,
            "note": f"{said}; with two springs {of_springs:.4f}, {springs_said}",
        }
    ]


def run() -> list[dict[str, Any]]:
    """Sweep the systems one after the other; count points, rungs and judgements; some again with planar friction."""
    outcomes = [outcome(SEED, number) for number in range(SYSTEMS)]
    points, failed = sum(o.points for o in outcomes), sum(o.failed for o in outcomes)
    rungs = sum((Counter(o.rescues) for o in outcomes), Counter())
    verdicts = Counter(j.verdict for o in outcomes for j in o.judgements)
    share = 1.0 - failed / points
    clean = sum(o.failed == 0 for o in outcomes)
    return [
        *planar(outcomes),
        {
            "name": "robustness/converged_share",
            "value": share,
            "goal": f">= {GOAL}",
            "holds": share >= GOAL,
            "note": f"{points} points of {SYSTEMS} systems, seed {SEED}, {clean} systems without a failure, "
            f"{sum(o.seconds for o in outcomes):.0f} CPU s; points by rung {dict(sorted(rungs.items()))}",
        },
        {
            "name": "robustness/wrong_points",
            "value": verdicts["wrong"],
            "goal": "<= 0",
            "holds": verdicts["wrong"] == 0,
            "note": f"against time integration, a tenth of the systems: {dict(verdicts)}",
        },
    ]
