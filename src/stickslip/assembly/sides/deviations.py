"""Mistuning as low-rank changes of the wheel's matrices."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.assembly.locations import picked, stacked
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import at_speed, damped
from stickslip.assembly.sides.mistuning import BladeMistuning, OwnSector
from stickslip.assembly.sides.wheel import faces_of, leaders, own_and_onward
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import factorise
from stickslip.model.modes import normal_modes
from stickslip.model.part import Part
from stickslip.model.structure import Structure, numbered_dofs
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.mistuned import of_alike, strip
from stickslip.units import HZ

FEW_ROWS = 30  # components of a sector's motion: with more, using all coordinates of the wheel costs no more
Changes = dict[str, FloatArray]  # "mass", "damping", "stiffness" -> (n_s m, n_s m)


@dataclass(frozen=True, eq=False)
class Deviation:
    """Deviation of the matrices of sectors from the tuned ones.

    Parameters
    ----------
    rows
        (r, N) CSR on the dofs of all parts: components of a sector's motion on which the deviation acts.
    factors
        (n_s, r) additional stiffness of each component; None where components are many and `change` alone applies.
    change
        Couplings (n_s, r, m) of these rows with all coordinates -> changes of the matrices of the wheel.
    behind
        (r, N) CSR contribution of the sector that follows to each component; None: no contribution.
    """

    rows: Matrix
    factors: FloatArray | None = None
    change: Callable[[Matrix], Changes] | None = None
    behind: Matrix | None = None


def deviations(model: Model) -> list[Deviation]:
    """Return all deviations of the matrices of a model's sectors.

    Raises
    ------
    InputError
        If a name is unknown, or the replacement of a part has other dofs.
    """
    here = model.mistuning
    assert here is not None
    found = [_of_blades(model, name, one) for name, one in here.blades.items()]
    return [*found, *(_of_own(model, name, one) for name, one in here.own.items())]


@dataclass(frozen=True, eq=False)
class Blade:
    """Blade, fixed at its boundary with the rest of the part and with the neighbouring sectors.

    Parameters
    ----------
    stiffness, mass
        (b, b) matrices of the blade's own dofs.
    rows
        (b, N) CSR from the dofs of all parts to the forces on the blade's own dofs.
    whole
        Whether the blade is the whole part, without a fixed boundary.
    behind
        (b, N) CSR from the neighbour whose face follows these dofs to the same forces; None: no dof lies on a face.
    """

    stiffness: Matrix
    mass: Matrix
    rows: Matrix
    whole: bool
    behind: Matrix | None = None


def blade_of(model: Model, of: str, place: str, beyond: float | None = None) -> Blade:
    """Return the blade with the name ``part`` or ``part.set``.

    `beyond` is a radius in m, and `place` the study key, for messages.
    """
    head, _, rest = of.partition(".")
    part = model.places.part_of(head, place)
    structure = at_speed(head, part, model.spin(model.speed), model.steady[head])
    first, n = model.places.offset(head), model.places.n
    own = np.arange(structure.n)
    if rest:
        spot = model.places.spot(of, place)
        dofs = spot.dofs if spot.nodes is None else spot.nodes[spot.nodes >= 0]
        own = np.unique(dofs) - first
    if beyond is not None:
        arm = np.linalg.norm(part.axis.arm(structure.dofs.position[own]), axis=1)
        own = own[arm > beyond]
    if not own.size or part.body is not None:
        raise input_error(place, f"{of!r} is nothing that deforms", "Name a blade's node set or a part.")
    K, M = (scipy.sparse.csr_array(m) for m in (structure.stiffness, structure.mass))
    wide = picked(first + np.arange(structure.n), n)
    here = model.neighbours
    sector = None if here is None or part.sectors < 2 else faces_of(head, part, here.ahead)
    if own.size == structure.n:
        return Blade(K, M, K @ wide, whole=True)
    if np.isin(first + own, np.concatenate([model.ties.low, model.ties.high])).any():
        raise input_error(
            place,
            f"{of!r} has dofs that a join ties to the next sector, so that none of them is of one blade alone",
            "Leave the joined surfaces out of the set.",
        )
    if sector is None:
        return Blade(K[own][:, own], M[own][:, own], K[own] @ wide, whole=False)
    own = _of_one_blade(sector, own, of, place)
    # a dof of the face that leads is also on the face of a neighbour that follows, whose matrices act on it, too
    own_one, there = own_and_onward(sector, own)
    behind = (there.T @ K @ wide).tocsr() if there.nnz else None
    stiffness, mass = (scipy.sparse.csr_array(own_one.T @ m @ own_one + there.T @ m @ there) for m in (K, M))
    rows = scipy.sparse.csr_array(own_one.T @ K @ wide)
    return Blade(stiffness, mass, rows, whole=False, behind=behind)


def _of_one_blade(sector: CyclicSector, own: IntArray, of: str, place: str) -> IntArray:
    """Return the dofs of a blade without the dofs of the face that follows, which belong to a neighbour."""
    if np.isin(own, sector.shared).any():
        raise input_error(place, f"{of!r} has dofs that all sectors share", "Leave the axis or the hub out.")
    left = np.setdiff1d(own, sector.followers)
    if np.setdiff1d(leaders(sector, own), left).size:
        follows, leads, beside = ("high", "low", "next") if sector.ahead > 0 else ("low", "high", "previous")
        raise input_error(
            place,
            f"{of!r} has dofs of the {follows} cyclic face, which belong to the {beside} blade, but not their partners on the {leads} face",
            f"Take the partners on the {leads} face into the set, or leave the face out.",
        )
    return left


def blade_alone(blade: Blade, number: int) -> tuple[FloatArray, FloatArray]:
    """Return squared circular frequencies (r,) and shapes (b, r) of the lowest elastic modes of a blade alone."""
    b = blade.stiffness.shape[0]
    every = int(np.count_nonzero(blade.mass.diagonal()))
    structure = Structure(blade.mass, scipy.sparse.csr_array((b, b)), blade.stiffness, numbered_dofs(b))
    squares: FloatArray = np.zeros(0)
    shapes: FloatArray = np.zeros((b, 0))
    asked = 0
    while squares.size < number and asked < every:
        asked = min(asked + number - squares.size, every)  # rigid modes come first
        found = normal_modes(structure, asked)
        strained = found.squares > 0.0
        squares, shapes = found.squares[strained], np.real(found.shapes[:, strained])
    return squares, shapes


def blade_alone_hz(model: Model, of: str, number: int, place: str, beyond: float | None = None) -> FloatArray:
    """Return the lowest natural frequencies (r,) of a blade alone, Hz."""
    squares, _ = blade_alone(blade_of(model, of, place, beyond), number)
    return np.asarray(np.sqrt(squares) / HZ)


def _of_blades(model: Model, name: str, one: BladeMistuning) -> Deviation:
    blade = blade_of(model, one.of, f"mistuning.{name}.of", one.beyond_radius)
    factors = one.factors
    if factors.ndim == 2 or one.modes is not None:
        return _of_modes(name, blade, factors, one.modes)
    b = blade.stiffness.shape[0]
    first = model.places.offset(one.of.partition(".")[0])
    rows = picked(first + np.arange(b), model.places.n) if blade.whole else blade.rows
    behind = None if blade.whole else blade.behind
    if b <= FEW_ROWS:
        # K = V diag(w) Vᵀ; of a fixed blade [K K_r]ᵀ K⁻¹ [K K_r]
        values, vectors = np.linalg.eigh(blade.stiffness.toarray())
        weights = values if blade.whole else 1.0 / values
        return Deviation(
            scipy.sparse.csr_array(vectors.T @ rows),
            factors[:, None] * weights,
            behind=None if behind is None else scipy.sparse.csr_array(vectors.T @ behind),
        )
    kernel = blade.stiffness if blade.whole else factorise(blade.stiffness)

    def of_blade(blocks: Matrix) -> Changes:
        return {"stiffness": of_alike(blocks, kernel, factors)}

    return Deviation(rows, change=of_blade, behind=behind)


def _of_modes(name: str, blade: Blade, factors: FloatArray, number: int | None) -> Deviation:
    """Return the deviation of single modes of the blades: each acts on its own share of the motion."""
    squares, shapes = blade_alone(blade, factors.shape[1] if number is None else number)
    if not squares.size:
        raise input_error(
            f"mistuning.{name}.of",
            "has no mode by itself that deforms it, which a deviation could change",
            "Name more of the blade.",
        )
    if factors.ndim == 2 and factors.shape[1] > squares.size:
        raise input_error(
            f"mistuning.{name}.deviations",
            f"is of {factors.shape[1]} modes, and the model's blade has {squares.size}",
            "Leave the others out.",
        )
    each = np.broadcast_to(factors.reshape(len(factors), -1), (len(factors), squares.size))
    # with K φ = ω² M φ, φᵀ [K K_r] u is ω² times the mode's share of u minus the static motion by the rest
    weights = (shapes / np.sqrt(squares)).T
    behind = None if blade.behind is None else scipy.sparse.csr_array(weights @ blade.behind)
    return Deviation(scipy.sparse.csr_array(weights @ blade.rows), each, behind=behind)


def _of_own(model: Model, name: str, one: OwnSector) -> Deviation:
    """Return the change by another part in one sector, in the coordinates of the tuned wheel."""
    key = f"mistuning.{name}"
    old = model.places.part_of(one.part, f"{key}.part")
    _refuse_unlike(key, old, one.by)
    spin, rest = model.spin(model.speed), model.steady[one.part]
    before, after = (damped(one.part, p, at_speed(one.part, p, spin, rest)) for p in (old, one.by))
    kinds = ("mass", "damping", "stiffness")
    change = {
        kind: scipy.sparse.csr_array(getattr(after, kind)) - scipy.sparse.csr_array(getattr(before, kind))
        for kind in kinds
    }
    touched: IntArray = np.unique(stacked(abs(m).tocsr().nonzero()[1] for m in change.values()))
    rows = picked(model.places.offset(one.part) + touched, model.places.n)
    small = {kind: m[touched][:, touched] for kind, m in change.items()}

    def of_own(blocks: Matrix) -> Changes:
        own = strip(blocks, one.sector)
        return {kind: own.T @ (m @ own) for kind, m in small.items() if m.nnz}

    return Deviation(rows, change=of_own)


def _refuse_unlike(key: str, old: Part, new: Part) -> None:
    if new.sectors != old.sectors:
        raise input_error(
            f"{key}.by",
            f"is one of {new.sectors} sectors, and the part in whose place it stands one of {old.sectors}",
            f"Give it sectors = {old.sectors}.",
        )
    before, after = old.structure, new.structure
    same = before.n == after.n and before.dofs.component == after.dofs.component
    if not (same and np.array_equal(before.dofs.node, after.dofs.node)):
        raise input_error(
            f"{key}.by",
            f"has {after.n} dofs, and the part in whose place it stands has {before.n}, or they are numbered otherwise",
            "Take the same mesh, its nodes moved or of another material.",
        )
