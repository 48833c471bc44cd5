"""The chain with Jenkins elements solved by pyHarm-os; run by `bench_chain` in pyHarm's own environment, prints one JSON object.

    python rival_pyharm.py '{"masses": 20, "mass": 1.0, ...}'

pyHarm pins versions of its own, so that nothing of this file is imported by the rest of the benchmarks, and nothing of
stickslip is imported here.
"""

import json
import logging
import sys
from importlib.metadata import version
from time import process_time

import numpy as np
from pyHarm.Maestro import Maestro


def description(case: dict, options: dict) -> dict:
    """Return pyHarm's input for the chain and one forced response."""
    n = case["masses"]
    stiffness = case["stiffness"] * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness[-1, -1] = case["stiffness"]
    matrices = {
        "M": case["mass"] * np.eye(n),
        "C": case["damping_factor"] * stiffness,
        "K": stiffness,
        "G": np.zeros((n, n)),
    }
    connectors = {
        f"jenkins{i}": {
            "type": "Jenkins",
            "connect": {"chain": [i]},
            "dirs": [0],
            "mu": 1.0,
            "N0": case["limit"],
            "k": case["k_t"],
        }
        for i in range(case["elements"])
    }
    connectors["force"] = {"type": "CosinusForcing", "connect": {"chain": [n - 1]}, "dirs": [0], "amp": case["force"]}
    first, last = case["omega_range"]
    analysis = {
        "study": "frf",
        "puls_inf": first,
        "puls_sup": last,
        "ds0": options["step"],
        "ds_max": options["step"],
        "ds_min": 1e-8,
        "predictor": "tangent",
        "corrector": options["corrector"],
        "solver": options["solver"],
        "solver_options": options["solver_options"],
        "reductors": [{"type": options["reductor"]}],
        "stopper": "solnumber",
        "stopper_options": {"max_solutions": case["points"]},
        "verbose": False,
    }
    return {
        "system": {"type": "Base", "nh": case["order"], "nti": case["samples"]},
        "substructures": {"chain": {"matrix": matrices, "ndofs": 1}},
        "connectors": connectors,
        "analysis": {"frf": analysis},
    }


def solve(case: dict, options: dict) -> dict:
    """Run one forced response; the construction of the system is not timed."""
    maestro = Maestro(description(case, options))
    study = maestro.nls["frf"]
    counts = {"jacobians": 0}
    jacobian = maestro.system.Jacobian

    def counted(x):
        counts["jacobians"] += 1
        return jacobian(x)

    maestro.system.Jacobian = counted
    began = process_time()
    maestro.operate()
    seconds = process_time() - began
    found = [s for s in study.SolList if s.flag_accepted]
    return {
        "seconds": seconds,
        "tried": len(study.SolList),
        "jacobians": counts["jacobians"],
        "residual": max(float(np.linalg.norm(s.R[:-1])) for s in found),
        "omega": [float(s.x[-1]) for s in found],
        "unknowns": [s.x[:-1].tolist() for s in found],
    }


def main() -> None:
    """Solve the case once for compilation, with two points, and some times for the numbers."""
    logging.disable(logging.CRITICAL)
    case = json.loads(sys.argv[1])
    options, runs = case.pop("options"), case.pop("rival_runs")
    solve(case | {"points": 2}, options)
    fastest = min((solve(case, options) for _ in range(runs)), key=lambda found: found["seconds"])
    print(json.dumps(fastest | {"version": version("pyHarm-os")}))


if __name__ == "__main__":
    main()
