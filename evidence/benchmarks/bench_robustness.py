"""Share of points of random small systems that converge, in a run short enough to stand beside the others; the whole one is `robustness`."""

from collections import Counter
from typing import Any

from evidence.benchmarks.robustness import GOAL, outcome

SYSTEMS = 40
SEED = 7


def run() -> list[dict[str, Any]]:
    """Sweep the systems one after the other; count points, rungs and judgements."""
    outcomes = [outcome(SEED, number) for number in range(SYSTEMS)]
    points, failed = sum(o.points for o in outcomes), sum(o.failed for o in outcomes)
    rungs = sum((Counter(o.rescues) for o in outcomes), Counter())
    verdicts = Counter(j.verdict for o in outcomes for j in o.judgements)
    share = 1.0 - failed / points
    clean = sum(o.failed == 0 for o in outcomes)
    return [
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
