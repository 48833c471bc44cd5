"""
A strategy of one's own
=======================

Harmonics chosen by the contact forces that nothing balances.

Run it as it is; nothing of the package is touched.
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
    blade = ss.Part(structure=ss.model.lumped(one, one, 0.02 * one, names=("tip",)))  # kg, N/m, N s/m
    damper = ss.Contact(between=("blade.tip", "ground"), law=ss.Jenkins(k_t=0.5, limit=0.035), acts="tangential")
    model = ss.Model(
        parts={"blade": blade},
        contacts={"damper": damper},
        loads={"shaker": ss.Load(on="blade.tip", newton=0.1)},
        outputs=(ss.Output(name="tip", on="blade.tip"),),
    )
    # high="auto" would ask it only where there are fewest harmonics, and go its own way beyond
    hertz = tuple(np.linspace(0.1, 0.7, 13) / (2 * np.pi))
    mine = model.forced_response(frequencies_hz=hertz, high=5, selection=Unbalanced(), stability="off")
    data = mine["forced_response"]
    for i, hz in enumerate(data.frequency_hz.values):
        kept = ", ".join(str(h) for h in np.flatnonzero(data.harmonic_kept.values[i]))
        print(f"{hz:.4f} Hz: {data.amplitude.values[i].max():.4f} m with harmonics {kept}")
    print(f"{data.unknowns_solved.item():.0f} unknowns solved")
