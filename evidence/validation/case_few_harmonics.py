"""Verdicts on the stability of random motions with 1, 3 and 5 harmonics against those of the same motions with 31.

    python -m evidence.validation.case_few_harmonics --systems 100 --minutes 30

A verdict that holds must be that of many harmonics; the others are to be undecided.
"""

import argparse
from collections import Counter
from dataclasses import replace
from time import process_time

import numpy as np

from evidence.benchmarks.robustness import OutOfTimeError, at_most
from evidence.models.random_motions import as_solved, random_motion
from evidence.models.solving import solve
from evidence.validation.compare import Record, record
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness
from stickslip.response.stability import stability

CASE = "Stability with few harmonics"
SOURCE = "multipliers with 31 harmonics"
FEW, MANY = (1, 3, 5), 31
SECONDS = 15.0  # CPU, of a motion
SYSTEMS = 12


def with_harmonics(problem: ForcedProblem, point: ForcedPoint, order: int) -> ForcedPoint:
    """Return the solution with harmonics up to `order` that Newton's method finds from a point."""
    balance = with_stiffness(problem.balance(harmonics_of(order)))
    x = solve(balance, point.omega, balance.unknowns(point.coefficients))
    return replace(point, coefficients=balance.coefficients(x), harmonics=np.arange(order + 1))


def verdicts(seed: int, number: int) -> list[tuple[int, str, str, str]]:
    """Return harmonics, verdict of the motion as it was solved, verdict, and that with many harmonics; where all were found."""
    motion = random_motion(seed, number)
    if isinstance(motion, str):
        return []
    found = []
    for order in FEW:
        try:
            with at_most(SECONDS):
                point = with_harmonics(motion.problem, motion.point, order)
                many = with_harmonics(motion.problem, point, MANY)
                plain, truth = (as_solved(motion.problem, p) for p in (point, many))
                if plain.transitions:
                    own = stability(motion.problem, point)
                    found.append((order, plain.verdict, own.verdict, truth.verdict))
        except (RuntimeError, OutOfTimeError):
            continue
    return found


def table(found: list[tuple[int, str, str, str]]) -> str:
    """Return what came out, in lines."""
    lines = []
    for order in FEW:
        own = [row for row in found if row[0] == order]
        plain_wrong = sum(row[1] != row[3] for row in own)
        wrong = sum(row[2] not in (row[3], "undecided") for row in own)
        open_ = [row for row in own if row[2] == "undecided"]
        needless = sum(row[1] == row[3] for row in open_)
        truth = Counter(row[3] for row in own)
        lines.append(
            f"H = {order}: {len(own)} motions, {truth['unstable']} unstable; as solved {plain_wrong} wrong; "
            f"verdicts: {wrong} wrong, {len(open_)} undecided, {needless} of these right as solved"
        )
    return "\n".join(lines)


def run() -> list[Record]:
    """Count wrong verdicts of the first systems."""
    found = [row for number in range(SYSTEMS) for row in verdicts(2, number)]
    wrong = sum(row[2] not in (row[3], "undecided") for row in found)
    return [record(CASE, f"wrong verdicts of {len(found)}", wrong, 0.0, 0.0, SOURCE)]


def main() -> None:
    """Count until there are so many systems, or the time is up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--systems", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=2)
    options = parser.parse_args()
    found, began = [], process_time()
    for number in range(options.systems):
        if process_time() - began > 60.0 * options.minutes:
            break
        found += verdicts(options.seed, number)
    print(f"{number + 1} systems")
    print(table(found))


if __name__ == "__main__":
    main()
