"""Compiled kernels are kept on disk: a second process loads them and compiles nothing.

A process evaluates contacts of every law by every evaluator, on one and on two threads, and a law of a script of its own, and assembles a
Jacobian. It then asks all compiled functions of the package and of the script how often they were compiled and how often loaded.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

CALL = """
import json
import sys
from dataclasses import dataclass
from time import process_time
import numpy as np
from numba.core.dispatcher import Dispatcher
import stickslip as ss
from stickslip.contact import threads
from stickslip.contact.interface import Interface
from stickslip.contact.laws import LAWS
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import chain


def step(displacement, velocity, state, parameters, force, new_state, jac, status):
    force[:] = 0.0
    force[2] = parameters[0] * displacement[2]
    jac[2, 2] = parameters[0]
    status[:] = 0


@dataclass(frozen=True)
class Own:
    kernel = ss.contact.law_kernel(step)
    pairs = 5

    def parameters(self):
        return np.array([3.0])

    def initial_state(self):
        return np.zeros(0)

    def stuck_stiffness(self):
        return np.array([0.0, 0.0, 3.0])


GIVEN = {
    "bonded": {"k_t": 1.0, "k_w": 1.0, "k_n": 1.0},
    "unilateral_spring": {"k_n": 1.0, "preload": 1.0},
    "cubic_spring": {"k_t": 1.0, "cubic_t": 1.0},
    "polynomial_spring": {"along_t": (1.0, 0.0, 1.0), "along_w": (1.0,), "along_n": (1.0,)},
    "jenkins": {"k_t": 1.0, "limit": 0.5},
    "elastic_coulomb": {"k_t": 1.0, "k_w": 1.0, "k_n": 1.0, "mu": 0.5, "preload": 1.0},
    "coupled_coulomb": {"k_t": 1.0, "k_n": 1.0, "mu": 0.5, "preload": 1.0},
    "regularised_coulomb": {"mu": 0.5, "transition_velocity": 1.0, "k_n": 1.0, "preload": 1.0},
    "dahl": {"k_t": 1.0, "limit": 0.5},
    "bouc_wen": {"k_t": 1.0, "alpha": 0.1, "a": 1.0, "beta": 0.5, "gamma": 0.5, "exponent": 1.0},
    "iwan": {"k_t": 1.0, "limit": 0.5, "population": ss.contact.UniformBand(n_sliders=4, half_width=0.5, elastic_share=0.0)},
}
assert set(GIVEN) == set(LAWS), "a law is not measured"


def work():
    laws = [law(**GIVEN[name]) for name, law in LAWS.items()] + [Own()]
    gap = np.cos(np.arange(9.0 * len(laws))).reshape(3, -1)
    for worth in (10**9, 1):
        threads.CONTACTS_WORTH_THREADS = worth
        for evaluator in ("march", "intervals", "events"):
            ss.harmonic.contact_forces(gap, ss.contact.compile_contacts(laws, None, evaluator), 64)
    structure = chain(2, 1.0, 1.0, 0.1)
    gap_operator = np.zeros((3, 2))
    gap_operator[0, 0] = 1.0
    interface = Interface(("one",), (laws[4],), gap_operator)
    load = HarmonicLoad(np.zeros(2), {1: np.array([0.0, 1.0 + 0.0j])})
    for form in ("dense", "structured"):
        balance = harmonic_balance(condense(structure, np.array([0, 1]), load), interface, 2, 64, jacobian=form)
        jac = balance.linearise(np.ones(balance.size), 1.0).jac
        jac @ np.ones(balance.size) if form == "dense" else jac.matvec(np.ones(balance.size))


start = process_time()
work()
seconds = process_time() - start
seen = {}
for name, module in list(sys.modules.items()):
    if name == "__main__" or name.startswith("stickslip"):
        for thing in list(vars(module).values()):
            # the step of a law is an attribute of its class
            for found in (thing, getattr(thing, "kernel", None) if isinstance(thing, type) else None):
                if isinstance(found, Dispatcher):
                    seen[id(found)] = found
stats = {f"{d.py_func.__module__}.{d.py_func.__name__}": d.stats for d in seen.values()}
print(json.dumps({
    "seconds": seconds,
    "compiled": sorted(name for name, s in stats.items() if sum(s.cache_misses.values())),
    "loaded": sorted(name for name, s in stats.items() if sum(s.cache_hits.values())),
}))
"""


def first_call(script: Path, cache: str) -> dict[str, Any]:
    """Return CPU seconds, functions compiled and functions loaded in a new process that keeps kernels in `cache`."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache, "NUMBA_NUM_THREADS": "2"}
    out = subprocess.run([sys.executable, str(script)], env=environment, capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(out.stdout.splitlines()[-1])
    return found


def run() -> list[dict[str, Any]]:
    """Do the same work in each of two processes that share an empty cache."""
    with tempfile.TemporaryDirectory() as cache:
        script = Path(cache) / "own_law.py"
        script.write_text(CALL)
        first = first_call(script, cache)
        second = first_call(script, cache)
    names = ", ".join(second["compiled"]) or "none"
    return [
        {
            "name": "contact/compiled_by_second_process",
            "value": len(second["compiled"]),
            "goal": "<= 0",
            "holds": not second["compiled"] and "__main__.step" in second["loaded"],
            "note": f"all laws, one of a script among them, by all evaluators; the first process compiled {len(first['compiled'])} functions, "
            f"the second loaded {len(second['loaded'])} and compiled {names}",
        },
        {
            "name": "contact/first_call_with_cache_seconds",
            "value": second["seconds"],
            "goal": "none",
            "holds": True,
            "note": f"CPU of the calls in the second process; in the first, with an empty cache, {first['seconds']:.1f} s",
        },
    ]
