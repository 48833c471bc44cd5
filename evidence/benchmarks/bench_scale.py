"""A large sector reduced to 100 interface nodes and 50 modes: CPU time of every step, peak memory.

    python -m evidence.benchmarks.bench_scale 0.1865          # 110 k nodes: seven minutes and 6.5 GB
    python -m evidence.benchmarks.bench_scale 0.313 3         # 28 k nodes at wave number 3: complex matrices

`run` measures 16 k nodes in a process of its own, so that the peak is that of the reduction.
"""

import json
import resource
import subprocess
import sys
from itertools import pairwise
from time import perf_counter, process_time
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave

FINENESS = 0.4
SECTORS = 24
NODES, MODES = 100, 50


def sector(fineness: float) -> Structure:
    """Return the default sector, with the element sizes times `fineness`."""
    plain = ss.BladedSector(sectors=SECTORS)
    sizes = {name: fineness * getattr(plain, name) for name in ("disk_size", "platform_size", "airfoil_size")}
    mesh = ss.model.mesh_sector(ss.BladedSector(sectors=SECTORS, **sizes))
    return ss.model.assemble_solid(mesh, ss.Material())


def interface(structure: Structure) -> np.ndarray:
    """Return the dofs of 100 nodes spread over the platform's undersides."""
    nodes = structure.dof_set("platform_under").reshape(-1, 3)
    return nodes[np.linspace(0, len(nodes) - 1, NODES).astype(int)].ravel()


def reduce(fineness: float, wave: int | None) -> dict[str, Any]:
    """Reduce and return the CPU and wall seconds at the beginning of every step, and the peak."""
    steps: list[tuple[str, float, float, float]] = []

    def say(text: str) -> None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        steps.append((text, process_time(), perf_counter(), peak))

    say("mesh and matrices")
    structure = sector(fineness)
    if wave is not None:
        say("wave")
        structure = travelling_wave(cyclic_sector(structure, SECTORS), wave)
    say("bodies")
    reduced = ss.craig_bampton(structure, interface(structure), MODES, say=say)
    say("end")
    return {
        "dofs": structure.n,
        "reduced": reduced.n,
        "frequencies_hz": ss.model.natural_frequencies(reduced, 3).tolist(),
        "steps": [{"step": a[0], "cpu": b[1] - a[1], "wall": b[2] - a[2], "peak_gb": b[3]} for a, b in pairwise(steps)],
    }


def run() -> list[dict[str, Any]]:
    """Measure in a process of its own."""
    command = [sys.executable, "-m", "evidence.benchmarks.bench_scale", str(FINENESS)]
    found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    cpu = sum(step["cpu"] for step in found["steps"])
    peak = max(step["peak_gb"] for step in found["steps"])
    note = f"{found['dofs']} dofs to {found['reduced']}; " + ", ".join(
        f"{step['step']} {step['cpu']:.1f} s" for step in found["steps"]
    )
    return [
        {
            "name": "scale/craig_bampton_cpu_seconds",
            "value": cpu,
            "goal": "<= 120 s",
            "holds": cpu <= 120,
            "note": note,
        },
        {
            "name": "scale/craig_bampton_peak_gb",
            "value": peak,
            "goal": "<= 2 GB",
            "holds": peak <= 2,
            "note": f"{found['dofs']} dofs, mesh and matrices included",
        },
    ]


if __name__ == "__main__":
    wave_number = int(sys.argv[2]) if len(sys.argv) > 2 else None
    print(json.dumps(reduce(float(sys.argv[1]), wave_number), indent=1))
