"""Random machines, judged: ``python -m evidence.trust --systems 60 --seed 1 --workers 2``.

Of each machine the default response is asked. Up to twelve of its solved points are judged, those at which contacts act first, then its peak, and all doubtful ones
up to eight. Off is the largest error of any output in the driven harmonic as a complex number, relative to the output or 1 % of the largest output.
"""

import argparse
from collections import Counter
from collections.abc import Iterable
from multiprocessing import get_context

import numpy as np

from evidence.trust.trial import SURE, Judged, Outcome, outcome


def _decays(judged: Judged) -> bool:
    """Whether the judge finds a point stable, beyond its own error."""
    return judged.multiplier < 1 - max(SURE * judged.multiplier_error, 1e-6)


def show(outcomes: Iterable[Outcome], seed: int) -> None:
    """Print the rows."""
    every = sorted(outcomes, key=lambda o: o.number)
    points = sum(o.points for o in every)
    levels = np.sum([o.levels for o in every], axis=0)
    judged = [(o, j) for o in every for j in o.judged]
    trusted = [(o, j) for o, j in judged if j.level == 0]
    doubted = [(o, j) for o, j in judged if j.level == 1]
    stable = [(o, j) for o, j in judged if j.stability in ("stable", "carried")]
    false_doubts = [j for _, j in doubted if not j.wrong]
    share = len(false_doubts) / max(len(doubted), 1)
    print(
        f"seed {seed}: {len(every)} machines, {points} points ({sum(o.acting for o in every)} with contacts that act), {sum(o.seconds for o in every):.0f} s of CPU"
    )
    print(f"points unsolved: {sum(o.unsolved for o in every)}")
    print(f"trusted, doubtful, wrong: {levels.tolist()}")
    print(f"judged: {len(judged)}; without a judgement: {sum(o.unjudged for o in every)}")
    print(f"trusted and more than 5 % off: {sum(j.wrong for _, j in trusted)} of {len(trusted)}")
    print(
        f"trusted and unstable (not told so): {sum(j.unstable and j.stability != 'unstable' for _, j in trusted)}; told unstable: {sum(j.unstable and j.stability == 'unstable' for _, j in trusted)}"
    )
    print(f"called stable and unstable: {sum(j.unstable for _, j in stable)} of {len(stable)}")
    called = [j for _, j in judged if j.stability == "unstable"]
    print(f"called unstable and stable: {sum(_decays(j) for j in called)} of {len(called)}")
    print(
        f"trusted and not examined: {sum(o.not_examined for o in every)} of {levels[0]}; peaks: {sum(o.peak_level == 0 and o.peak_stability == 'not examined' for o in every)}"
    )
    print(
        f"doubtful though right: {share:.0%} of {len(doubted)} judged doubts, {share * levels[1] / max(points, 1):.2%} of all points"
    )
    print(
        f"doubtful peaks: {sum(o.peak_level == 1 for o in every)}, wrong peaks: {sum(o.peak_level == 2 for o in every)}"
    )
    for text, count in Counter(j.reason for j in false_doubts).most_common(8):
        print(f"   {count:4d} false doubts: {text}")
    for o, j in judged:
        if (
            (j.level == 0 and (j.wrong or (j.unstable and j.stability != "unstable")))
            or (j.unstable and j.stability in ("stable", "carried"))
            or (j.stability == "unstable" and _decays(j))
        ):
            print(
                f"   machine {o.number} ({o.family}) {j.hz:.4f} Hz: level {j.level}, {j.stability}, off {j.off:.1%} (judge {j.motion_error:.0e}), multiplier {j.multiplier:.5f} ± {j.multiplier_error:.0e}"
            )
    for o in every:
        if o.error or o.unsolved:
            print(f"   machine {o.number} ({o.family}): {o.unsolved} unsolved {o.error}")


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--systems", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    numbers = range(args.first, args.first + args.systems)
    with get_context("spawn").Pool(args.workers) as pool:
        found = pool.starmap(outcome, [(args.seed, n) for n in numbers], chunksize=1)
    show(found, args.seed)


if __name__ == "__main__":
    main()
