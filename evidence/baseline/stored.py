"""The baseline's files: a digest of every variable, and the values of those that are compared with a tolerance."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from evidence.baseline.compare import CASES, FIELDS, NUMBERS, STATES, STATIC, digest
from evidence.baseline.results import Node, timeless

HERE = Path(__file__).parent
KEPT = ("frequency_hz", "point_case", *STATES, *FIELDS, *CASES, *STATIC)
LARGEST = 100_000  # bytes of a variable of modes, Campbell or SAFE that is kept whole; the shapes have their digest


def store(name: str, nodes: Mapping[str, Node]) -> None:
    """Write ``NAME.npz`` from the nodes of a result."""
    arrays: dict[str, np.ndarray] = {}
    digests = {}
    for key, whole in nodes.items():
        node = timeless(whole)
        digests[key] = {variable: digest(values) for variable, values in node.items()}
        arrays |= {f"{key}/{variable}": _small(node[variable]) for variable in _kept(key, node)}
    arrays["digests"] = np.array(json.dumps(digests))
    np.savez_compressed(HERE / f"{name}.npz", **arrays)


def _kept(key: str, node: Node) -> list[str]:
    if key == "forced_response":
        return [name for name in KEPT if name in node]
    return [n for n, v in node.items() if v.nbytes <= LARGEST and v.dtype.kind in NUMBERS]


def _small(values: np.ndarray) -> np.ndarray:
    """Return whole numbers in as few bytes as they need."""
    if values.dtype.kind != "i":
        return values
    return values.astype(np.int8 if np.abs(values).max(initial=0) < 128 else np.int32)


def stored(name: str) -> tuple[dict[str, dict[str, str]], dict[str, Node]]:
    """Return digests and kept values of ``NAME.npz``, each by node and variable."""
    nodes: dict[str, Node] = {}
    with np.load(HERE / f"{name}.npz") as archive:
        digests = json.loads(archive["digests"].item())
        for entry in archive.files:
            if entry != "digests":
                key, variable = entry.split("/")
                nodes.setdefault(key, {})[variable] = archive[entry]
    return digests, nodes
