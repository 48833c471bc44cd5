"""
A strategy of one's own
=======================

Harmonics chosen by the contact forces that nothing balances.

Run it as it is; nothing of the package is touched. It uses the layers below ``ss.Model``: a strategy sees the balance itself.
"""

from dataclasses import dataclass

import numpy as np

import stickslip as ss

# The rule: what a solution says about the harmonics that it lacks.


@dataclass(frozen=True)
class Unbalanced:
    threshold: float = 0.02  # largest force in a missing harmonic that is accepted, by the excitation

    # a verdict speaks of the solution itself, so that a double passage can be made of it
    verifies = True

    def judge(self, step):
        have, reference = step.balance.harmonics, step.reference
        padded = reference.unknowns(step.balance.coefficients(step.x))
        forces = reference.contacts(padded, step.omega).coefficients  # rows 1, cos, sin, cos 2, ...
        drive = max(np.abs(f).max() for f in reference.linear.load.harmonics.values())
        missing = [h for h in reference.harmonics if h not in have]
        left = {h: np.abs(forces[2 * h - 1 : 2 * h + 1]).max() / drive for h in missing}
        loud = [h for h in missing if left[h] > self.threshold]
        again = tuple(sorted({*have, *loud})) if loud else None
        return ss.harmonic.Verdict(max(left.values(), default=0.0), again, following=step.smallest)


# A mass with a friction damper of a constant limit, shaken below its resonance: it sticks, then it slips.

if __name__ == "__main__":
    one = np.ones((1, 1))
    structure = ss.model.lumped(mass=one, stiffness=one, damping=0.02 * one, names=("blade",))
    friction = ss.Interface(("damper",), (ss.Jenkins(k_t=0.5, limit=0.035),), np.array([[1.0], [0.0], [0.0]]))
    system = ss.System(structure, friction, outputs=np.array([0]))
    shaker = ss.HarmonicLoad(np.zeros(1), {1: np.array([0.1 + 0j])})
    sweep = ss.Sweep(
        omega_range=(0.1, 0.7), high=5, frequencies=13, peak_points=0, selection=Unbalanced()
    )  # high="auto" would ask it only where there are fewest harmonics, and go its own way beyond
    problem = ss.response.forced_problem(system, shaker, sweep)
    solved = list(ss.forced_response(system, shaker, sweep))
    points = ss.response.accepted_points(solved)
    for point in points:
        kept = ", ".join(str(h) for h in point.support)
        blade = abs(ss.response.fields(problem, point).outputs[1, 0])  # point.coefficients: retained coordinates
        print(f"{point.omega:.3f} rad/s: {blade:.4f} m with harmonics {kept}")
    unknowns = sum(system.retained.size * (2 * len(point.support) - 1) for point in solved)
    print(f"{unknowns} unknowns solved at {len(points)} frequencies")
