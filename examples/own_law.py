"""
A contact law of one's own
==========================

A Jenkins element whose friction limit grows with the sliding velocity.

Run it as it is; nothing of the package is touched. The first run compiles the step of the law, later ones load it.
"""

from dataclasses import dataclass

import numpy as np

import stickslip as ss

# The behaviour: what happens between one sample and the next, with its derivatives. The state is the position of the slider.


def step(displacement, velocity, state, parameters, force, new_state, jac, status):
    k, limit, per_velocity = parameters
    x, v, slider = displacement[0], velocity[0], state[0]
    force[:] = 0.0  # along t, w, n; jac comes zeroed
    strength = limit * (1.0 + per_velocity * abs(v))
    trial = k * (x - slider)
    if abs(trial) <= strength:  # stick
        force[0] = trial
        new_state[0] = slider
        jac[0, 0], jac[0, 6] = k, -k  # by displacement (columns 0 to 2) and by the state (from 6)
        jac[3, 6] = 1.0  # row 3: the new state
        status[0], status[1] = 0, 0
        return
    sign = 1.0 if trial > 0.0 else -1.0
    by_velocity = sign * limit * per_velocity * np.sign(v)
    force[0] = sign * strength
    new_state[0] = x - force[0] / k
    jac[0, 3] = by_velocity  # columns 3 to 5: velocity
    jac[3, 0], jac[3, 3] = 1.0, -by_velocity / k
    status[0], status[1] = 1, 0


# The parameters, in a frozen dataclass.


@dataclass(frozen=True)
class RateJenkins:
    k_t: float  # N/m
    limit: float  # N
    per_velocity: float  # s/m

    kernel = ss.contact.law_kernel(step)
    pairs = 5  # neither tangent feels the other; 7: they do; 9: the normal force feels them, too

    def parameters(self):
        return np.array([self.k_t, self.limit, self.per_velocity])

    def initial_state(self):
        return np.zeros(1)

    def stuck_stiffness(self):
        return np.array([self.k_t, 0.0, 0.0])


# Are the derivatives right? An error names the first entry that is not.

ss.contact.check_law(RateJenkins(k_t=2e4, limit=5.0, per_velocity=2.0), size=1e-3, rate=0.1)

# Two masses, the second held by the friction element, shaken through their first resonance.


def peak(law):
    """Peak of the tip, m."""
    stiffness = np.array([[3e4, -1e4], [-1e4, 1e4]])
    damping = np.array([[3.0, -1.0], [-1.0, 1.0]])
    bar = ss.model.lumped(np.array([1.0, 0.5]), stiffness, damping, names=("base", "tip"))
    friction = ss.Contact(between=("bar.tip", "ground"), law=law, acts="tangential")
    model = ss.Model(
        parts={"bar": ss.Part(structure=bar)},
        contacts={"friction": friction},
        loads={"shaker": ss.Load(on="bar.tip", newton=1.0)},
    )
    # by intervals, as laws of one's own are: the two then agree to rounding
    keys = {"low": 3, "high": 3, "selection": "always_low", "evaluator": "intervals"}
    found = model.forced_response(hz=(60 / (2 * np.pi), 140 / (2 * np.pi)), stability="off", **keys)
    return found.peaks["amplitude (m)"][0]


if __name__ == "__main__":
    built_in = peak(ss.Jenkins(k_t=4e3, limit=0.6))
    same = peak(RateJenkins(k_t=4e3, limit=0.6, per_velocity=0.0))
    stronger = peak(RateJenkins(k_t=4e3, limit=0.6, per_velocity=2.0))
    print(f"Jenkins: {built_in * 1e6:.3f} µm; the own law without its rate: {same * 1e6:.3f} µm")
    print(f"with it: {stronger * 1e6:.3f} µm")
    stats = RateJenkins.kernel.stats
    print(f"compiled {sum(stats.cache_misses.values())}, loaded {sum(stats.cache_hits.values())}")
