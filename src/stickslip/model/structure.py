"""A linear structure: matrices, names of its coordinates, named sets, and the expansion to the full model."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error, nearest_and_known

NAMED = 8  # number of sets that a short description names
ROUNDING = 1e-10  # skew part of a damping matrix over the matrix, below which it is rounding
_NUMBERED = re.compile(r"dof[1-9]\d*")

ROTATIONS = ("rx", "ry", "rz")  # components that are angles


@dataclass(frozen=True, eq=False)
class Dofs:
    """Table of degrees of freedom, one row each.

    Parameters
    ----------
    node
        (n,) node numbers; -1 for coordinates without a mesh node, such as modes and rigid bodies.
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


@dataclass(frozen=True, eq=False)
class Structure:
    """A linear structure ``M ü + C u̇ + K u = f``.

    Parameters
    ----------
    mass, damping, stiffness
        (n, n) matrices in kg, N s/m, N/m; dense or SciPy CSR. Symmetric, or Hermitian for a
        travelling wave (`reduction.cyclic`); damping may include the skew Coriolis matrix of a rotating structure.
    dofs
        Table of the n coordinates.
    sets
        Name -> dof indices, in a meaningful order.
    basis
        (n_full, n) matrix with ``full = basis @ reduced``, dense or SciPy CSR, complex for a travelling wave;
        None if nothing was reduced.
    loss
        (n, n) structural (hysteretic) damping in N/m, the imaginary part of the stiffness in vibration: symmetric, or Hermitian
        like the stiffness; None: no such damping. It does not act in statics.

    Raises
    ------
    ValueError
        If shapes do not agree.
    """

    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    dofs: Dofs
    sets: Mapping[str, IntArray] = field(default_factory=dict)
    basis: Matrix | None = None
    loss: Matrix | None = None

    def __post_init__(self) -> None:
        n = len(self.dofs)
        for name in ("mass", "damping", "stiffness"):
            shape = getattr(self, name).shape
            if shape != (n, n):
                raise ValueError(f"Structure.{name}: shape {shape} for {n} dofs")
        if self.loss is not None and self.loss.shape != (n, n):
            raise ValueError(f"Structure.loss: shape {self.loss.shape} for {n} dofs")

    def __repr__(self) -> str:
        """Describe the structure in a line, without its matrices."""
        matrices = [self.mass, self.damping, self.stiffness]
        kind = "sparse" if any(scipy.sparse.issparse(m) for m in matrices) else "dense"
        numbers = "complex" if self.is_complex else "real"
        parts = [f"{self.n} dofs", f"{kind} {numbers}"]
        if self.loss is not None:
            parts.append("structural damping")
        if self.basis is not None:
            parts.append(f"in other coordinates than the {self.basis.shape[0]} dofs of its model")
        names = [f"{name} ({len(index)})" for name, index in self.sets.items()]
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        parts.append("sets " + ", ".join(names[:NAMED]) + more if names else "no sets")
        return f"<Structure: {'; '.join(parts)}>"

    @property
    def n(self) -> int:
        """Number of dofs."""
        return len(self.dofs)

    @property
    def is_complex(self) -> bool:
        """Whether a matrix is complex."""
        matrices = (self.mass, self.damping, self.stiffness, self.loss)
        return any(np.iscomplexobj(m) for m in matrices if m is not None)

    @property
    def multipliers(self) -> IntArray:
        """Indices of constraint forces (Lagrange multipliers) among the coordinates: none (see `LinearSide`)."""
        return np.zeros(0, dtype=np.int64)

    @property
    def wheel(self) -> None:
        """None: the structure is no tuned wheel (see `LinearSide`)."""
        return None

    @property
    def speed_follows_frequency(self) -> bool:
        """Whether the speed changes with the frequency: no (see `LinearSide`)."""
        return False

    @property
    def reduced(self) -> bool:
        """Whether coordinates without contact are condensed (see `LinearSide`)."""
        return True

    @property
    def harmonics(self) -> None:
        """None: the matrices apply to any harmonic (see `LinearSide`)."""

    def at_frequency(self, omega: float) -> "Structure":
        """Return the structure, which is the same at every frequency (see `LinearSide`)."""
        return self

    def of_harmonic(self, harmonic: int) -> "Structure":
        """Return the structure, which is the same in every harmonic (see `LinearSide`)."""
        return self

    def feedback_of(self, harmonic: int) -> None:
        """Return None: there is no aerodynamic force (see `LinearSide`)."""

    def dof_set(self, name: str) -> IntArray:
        """Return the dof indices of the set `name`; an `InputError` names the known sets."""
        if name not in self.sets:
            raise input_error("Structure", f"there is no set {name!r}", nearest_and_known(name, list(self.sets)))
        return self.sets[name]

    def expand(self, vector: Matrix) -> Matrix:
        """Return the full-model vector(s) of reduced coordinates `vector` (n,) or (n, k)."""
        return vector if self.basis is None else self.basis @ vector

    def project(self, load: Matrix) -> Matrix:
        """Return the load(s) on the reduced coordinates from full-model load(s) (n_full,) or (n_full, k)."""
        return load if self.basis is None else self.basis.conj().T @ load

    def grounded(self, springs: Matrix) -> "Structure":
        """Return the structure with springs, a sparse matrix (n, n) in N/m, from its coordinates to the ground."""
        sparse = scipy.sparse.issparse(self.stiffness)
        return replace(self, stiffness=self.stiffness + (springs if sparse else springs.toarray()))

    @property
    def coriolis(self) -> Matrix:
        """The skew part of the damping matrix, (n, n): Coriolis forces of a rotating structure."""
        return 0.5 * (self.damping - self.damping.conj().T)

    @property
    def turns(self) -> bool:
        """Whether the damping matrix has Coriolis forces, beyond rounding."""
        skew, every = (
            scipy.sparse.linalg.norm(m) if scipy.sparse.issparse(m) else np.linalg.norm(m)
            for m in (self.coriolis, self.damping)
        )
        return bool(skew > ROUNDING * every)

    def with_damping(self, damping: Matrix) -> "Structure":
        """Return the same structure with another damping matrix."""
        return replace(self, damping=damping)


def join(**parts: Structure) -> Structure:
    """Join structures into one, without coupling.

    Sets are renamed ``part.set``; a set ``part`` holds all dofs of each part. The joined structure has no `basis`:
    expand with the parts.
    """
    offsets = np.cumsum([0, *(s.n for s in parts.values())])
    sets: dict[str, IntArray] = {}
    for (name, part), offset in zip(parts.items(), offsets, strict=False):
        sets[name] = np.arange(offset, offset + part.n)
        sets.update({f"{name}.{key}": index + offset for key, index in part.sets.items()})

    def stack(which: str) -> Matrix:
        blocks = [getattr(s, which) for s in parts.values()]
        # some parts may have no loss matrix
        blocks = [np.zeros((s.n, s.n)) if b is None else b for s, b in zip(parts.values(), blocks, strict=True)]
        if any(scipy.sparse.issparse(b) for b in blocks):
            return scipy.sparse.block_diag(blocks, format="csr")
        return scipy.linalg.block_diag(*blocks)

    return Structure(
        stack("mass"),
        stack("damping"),
        stack("stiffness"),
        join_dofs({k: s.dofs for k, s in parts.items()}),
        sets,
        loss=stack("loss") if any(s.loss is not None for s in parts.values()) else None,
    )


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
