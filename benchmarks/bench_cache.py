"""Compiled kernels are kept on disk: a second process loads them and compiles nothing."""

import os
import subprocess
import sys
import tempfile
from typing import Any

CALL = """
from time import process_time
import numpy as np
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.intervals import contact_period
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.aft import contact_forces
law = compile_contacts([ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.5, preload=1.0)])
start = process_time()
contact_forces(np.ones((3, 3)), law, 64)
print(process_time() - start, sum(contact_period.stats.cache_misses.values()), sum(contact_period.stats.cache_hits.values()))
"""


def first_call(cache: str) -> tuple[float, int, int]:
    """Return CPU seconds, cache misses and cache hits of the first call in a new process that keeps kernels in `cache`."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
    out = subprocess.run(
        [sys.executable, "-c", CALL], env=environment, capture_output=True, text=True, check=True
    )
    seconds, misses, hits = out.stdout.split()
    return float(seconds), int(misses), int(hits)


def run() -> list[dict[str, Any]]:
    """Call the kernel once in each of two processes that share an empty cache."""
    with tempfile.TemporaryDirectory() as cache:
        compiled, _, _ = first_call(cache)
        loaded, misses, hits = first_call(cache)
    return [
        {
            "name": "contact/first_call_with_cache_seconds",
            "value": loaded,
            "goal": "no compilation",
            "holds": misses == 0 and hits > 0,
            "note": f"CPU of the first call in a second process: {hits} kernel loaded, {misses} compiled; without cache {compiled:.1f} s",
        }
    ]
