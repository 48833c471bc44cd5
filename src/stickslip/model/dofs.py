"""Names of the coordinates of a structure."""

import re
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray

_NUMBERED = re.compile(r"dof[1-9]\d*")

ROTATIONS = ("rx", "ry", "rz")  # components that are angles


@dataclass(frozen=True, eq=False)
class Dofs:
    """Table of degrees of freedom, one row each.

    Parameters
    ----------
    node
        (n,) node numbers; -1 for coordinates without a mesh node: modal ones and those of rigid bodies.
    component
        n names: ``x y z rx ry rz`` or ``mode``.
    position
        (n, 3) coordinates in metres; NaN for modal coordinates.
    part
        n names of the part of each dof; empty strings before parts are joined.
    """

    node: IntArray
    component: tuple[str, ...]
    position: FloatArray
    part: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.component)
        if self.node.shape != (n,) or self.position.shape != (n, 3):
            raise ValueError(f"Dofs: {n} components, nodes {self.node.shape}, positions {self.position.shape}")
        if not self.part:
            object.__setattr__(self, "part", ("",) * n)

    def __len__(self) -> int:
        return len(self.component)

    def take(self, index: IntArray) -> "Dofs":
        """Return the rows `index`, in that order."""
        return Dofs(
            self.node[index],
            tuple(self.component[i] for i in index),
            self.position[index],
            tuple(self.part[i] for i in index),
        )

    @property
    def labels(self) -> tuple[str, ...]:
        """Readable names such as ``blades.node12.x`` or ``damper.rx``."""
        names = []
        for node, component, part in zip(self.node, self.component, self.part, strict=True):
            prefix = f"{part}." if part else ""
            place = "" if node < 0 else f"node{node}."
            names.append(f"{prefix}{place}{component}")
        return tuple(names)


def numbered_dofs(n: int) -> Dofs:
    """Return the table of `n` dofs without known nodes: ``dof1``, ``dof2`` and so on."""
    names = tuple(f"dof{i + 1}" for i in range(n))
    return Dofs(np.full(n, -1), names, np.full((n, 3), np.nan))


def is_numbered(component: str) -> bool:
    """Whether a component is one of `numbered_dofs`."""
    return _NUMBERED.fullmatch(component) is not None


def modal_dofs(n: int) -> Dofs:
    """Return the table of `n` modal coordinates."""
    return Dofs(np.full(n, -1), ("mode",) * n, np.full((n, 3), np.nan))


def nodal_dofs(points: FloatArray, nodes: IntArray) -> Dofs:
    """Return the x, y, z dofs of `nodes` (node-major) at `points` (n_nodes, 3)."""
    return Dofs(np.repeat(nodes, 3), ("x", "y", "z") * len(nodes), np.repeat(points, 3, axis=0).astype(float))


def join_dofs(parts: dict[str, Dofs]) -> Dofs:
    """Stack tables; each row gets the name of its part."""
    return Dofs(
        np.concatenate([d.node for d in parts.values()]),
        tuple(c for d in parts.values() for c in d.component),
        np.vstack([d.position for d in parts.values()]),
        tuple(name for name, d in parts.items() for _ in range(len(d))),
    )
