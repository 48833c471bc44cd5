"""One evaluation of 100 contacts with isotropic planar friction, forces and full derivatives, at located events.

The contacts are those of the benchmark ``evaluators``, once with two springs, each with a limit of its own, and once with one spring in the
plane. Both are timed as Newton's method calls them; the march of the planar law stands next to them, with the samples of that benchmark.
The ratio to the two-spring law is what the plane costs: its two directions are coupled, slip has no closed form, and a contact that never
opens remembers its start.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from evidence.benchmarks.bench_evaluators import CASES, ROUNDS, Contacts, contacts, medians
from evidence.judges.planar_contact import Contact, judged
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.aft import contact_forces

GOAL, AIM = 8.0, 5.0
JUDGED = 20  # contacts
CLOSE, LIFTED = 1e-8, 1e-6  # distance from the judge while N stays above 1 % of its mean, and else


def planar(case: Contacts) -> list[CoupledCoulomb]:
    """Return the laws of `case` with the stiffness along t in every direction of the plane."""
    return [CoupledCoulomb(k_t=law.k_t, k_n=law.k_n, mu=law.mu, preload=law.preload) for law in case.laws]


def springs(case: Contacts) -> list[ElasticCoulomb]:
    """Return the laws of `case` with the stiffness along t in both directions."""
    return [ElasticCoulomb(k_t=law.k_t, k_w=law.k_t, k_n=law.k_n, mu=law.mu, preload=law.preload) for law in case.laws]


def evaluated(case: Contacts, laws: Any, samples: int, evaluator: Any = "events") -> Callable[[], Any]:
    """Return the evaluation as Newton's method calls it."""
    compiled = compile_contacts(laws, evaluator=evaluator)
    return lambda: contact_forces(case.gap, compiled, samples, history=False)


def costs(order: int, samples: int) -> list[dict[str, Any]]:
    """Compare the planar law at events with the two-spring law and with its own march."""
    case = contacts(order)
    plane = planar(case)
    seconds = medians(
        {"two springs": evaluated(case, springs(case), samples), "planar": evaluated(case, plane, samples)}, ROUNDS
    )
    slow = medians({"march": evaluated(case, plane, samples, "march")}, 3)
    period = contact_forces(case.gap, compile_contacts(plane, evaluator="events"), samples)
    shares = ", ".join(
        f"{np.mean(period.state == s):.0%} {word}" for s, word in enumerate(("stuck", "slipping", "open"))
    )
    where = f"{len(plane)} contacts, H = {order}, {shares}, {period.unsettled} unsettled"
    over, march = seconds["planar"] / seconds["two springs"], slow["march"] / seconds["planar"]
    return [
        {
            "name": f"planar/over_two_springs_H{order}",
            "value": over,
            "goal": f"<= {GOAL:g}, aim {AIM:g}",
            "holds": over <= GOAL,
            "note": f"CPU time of forces and blocks; {where}; ms: {1e3 * seconds['planar']:.1f} over {1e3 * seconds['two springs']:.1f}",
        },
        {
            "name": f"planar/march_over_events_H{order}",
            "value": march,
            "goal": "none",
            "holds": True,
            "note": f"{samples} samples, second order in them: {1e3 * slow['march']:.0f} ms",
        },
    ]


def distances(order: int) -> list[dict[str, Any]]:
    """Compare forces with those of an independent integration with located events."""
    case = contacts(order)
    laws = planar(case)[:JUDGED]
    found = contact_forces(case.gap[:, : 3 * JUDGED], compile_contacts(laws, evaluator="events"), 0, history=False)
    off: dict[bool, list[float]] = {False: [], True: []}
    for c, law in enumerate(laws):
        gaps = case.gap[:, 3 * c : 3 * c + 3]
        contact = Contact(law.k_t, law.k_n, law.mu, law.preload)
        want = judged(gaps, contact).coefficients
        tau = np.linspace(0.0, 2.0 * np.pi, 4096)
        angles = np.outer(tau, np.arange(1, order + 1))
        normal = law.preload - law.k_n * (gaps[0, 2] + np.cos(angles) @ gaps[1::2, 2] + np.sin(angles) @ gaps[2::2, 2])
        if normal.max() <= 0.0:
            continue
        error = np.max(np.abs(found.coefficients[:, 3 * c : 3 * c + 2] - want[:, :2]))
        off[bool(normal.min() < 0.01 * normal.mean())].append(error / (law.mu * normal.max()))
    return [
        {
            "name": f"planar/{name}_H{order}",
            "value": max(off[lifted]),
            "goal": f"<= {goal:g}",
            "holds": max(off[lifted]) <= goal,
            "note": f"largest distance of force coefficients from the judge in evidence/judges, of the largest limit; {len(off[lifted])} contacts",
        }
        for lifted, name, goal in ((False, "off_judge", CLOSE), (True, "off_judge_with_lift_off", LIFTED))
    ]


def run() -> list[dict[str, Any]]:
    """Compare cost and answer of planar friction at events."""
    records: list[dict[str, Any]] = []
    for order, samples, _, _ in CASES:
        records += costs(order, samples)
    return records + distances(5)
