"""MacNeal-Rubin reduction: free-interface modes and residual attachment modes.

R. H. MacNeal, "A hybrid method of component mode synthesis", Computers & Structures 1 (1971) 581-601; S. Rubin,
"Improved component-mode representation for structural dynamic analysis", AIAA Journal 13 (1975) 995-1006; as written by
M. Krack, L. Salles and F. Thouverez, Archives of Computational Methods in Engineering 24 (2017) 589-636, appendix 4.
"""

import math
from collections.abc import Sequence

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import SingularError, input_error
from stickslip.model.fe.factorisation import Say, Solve, factorise, silent
from stickslip.model.modes import submatrix
from stickslip.model.structure import Structure
from stickslip.reduction.basis import BLOCK, in_coordinates, kept_dofs, surviving_sets, with_modal_dofs
from stickslip.reduction.bodies import Body, BodyModes, loose_bodies, lowest_of, modes_up_to
from stickslip.reduction.truncation import FrequencyError, ModesBelow

DEPENDENT = 1e-8  # smallest allowed eigenvalue of the scaled residual flexibility of the kept dofs
NAMED = 4  # largest number of dofs in a message


def rubin(structure: Structure, keep: IntArray, n_modes: int | ModesBelow, *, say: Say = silent) -> Structure:
    """Reduce to the kept dofs and the lowest modes with those dofs free.

    Parameters
    ----------
    structure
        Full model, dense or sparse, real symmetric or complex Hermitian (a travelling wave); bodies may be free.
    keep
        (k,) indices of the dofs that stay physical: contact, excitation, output.
    n_modes
        Number of free-interface modes, including rigid motions, or `ModesBelow` a frequency.
    say
        Called with a sentence before each long step.

    Returns
    -------
    Structure
        Dense, with coordinates ``(u_keep [m], modal [√kg m])``. Sets whose dofs are all kept survive in their order;
        ``modes`` holds the modal coordinates. `basis` leads back.

    Raises
    ------
    InputError
        If `keep` or `n_modes` does not fit the structure, or `n_modes` is smaller than the number of rigid motions.
    SingularError
        If the residual flexibility of the kept dofs is singular; the message names dofs.

    Notes
    -----
    ``u = [I 0; Δ Φ_del − Δ Φ_ret] q`` (eq. 58) with the mass-normalised free modes Φ and ``Δ = R_del R_ret⁻¹`` from the
    residual flexibility ``R = K⁻¹ − Φ ω⁻² Φᴴ`` (eq. 59; the published equation divides by ω). To avoid cancellation it is computed
    as the response to loads without the part in the kept modes, ``R = K⁺ (I − M Φ Φᴴ)``, which also exists for free bodies
    (inertia relief). Exact in statics for loads on `keep`; the kept modes, including rigid motions, are exact.
    """
    keep = kept_dofs("rubin", structure, keep)
    most = structure.n - keep.size
    if isinstance(n_modes, FrequencyError) or (not isinstance(n_modes, ModesBelow) and not 0 <= n_modes <= most):
        raise input_error(
            "rubin: n_modes",
            f"got {n_modes}, and {most} dofs are not kept",
            "Give a number of modes up to that, or ModesBelow a frequency (kept modes are exact).",
        )
    bodies = loose_bodies(structure, np.arange(structure.n), say)
    modes = _free_modes(bodies, n_modes, say)
    flexibility = _residual_flexibility(structure, keep, bodies, modes, say)
    basis = _basis(structure, keep, bodies, modes, flexibility)
    k, m = keep.size, modes.squares.size
    dofs = with_modal_dofs(structure.dofs.take(keep), m)
    sets = surviving_sets(structure, keep) | {"modes": np.arange(k, k + m)}
    return in_coordinates(structure, basis, dofs, sets)


def _free_modes(bodies: Sequence[Body], n_modes: int | ModesBelow, say: Say) -> BodyModes:
    """Return the kept modes, after checking that they include all rigid motions."""
    if isinstance(n_modes, ModesBelow):
        return modes_up_to(bodies, 2 * math.pi * n_modes.factor * n_modes.up_to_hz, say)
    free = sum(body.shift < 0 for body in bodies)
    found = lowest_of(bodies, n_modes + 6 * free, say)
    rigid = int(np.count_nonzero(found.squares == 0))
    if rigid > n_modes:
        raise input_error(
            "rubin: n_modes",
            f"got {n_modes}, and the structure has {rigid} rigid motions, which have no residual flexibility",
            f"Ask for at least {rigid} modes, or clamp the structure.",
        )
    return found.first(n_modes)


def _residual_flexibility(
    structure: Structure, keep: IntArray, bodies: Sequence[Body], modes: BodyModes, say: Say
) -> Matrix:
    """Return the (n, k) residual flexibility: static response to unit forces on `keep` minus the response of the modes (eq. 59)."""
    kind = np.result_type(structure.stiffness.dtype, float, *(s.dtype for s in modes.shapes))
    R = np.zeros((structure.n, keep.size), dtype=kind)
    say(f"{keep.size} residual attachment modes")
    for i, body in enumerate(bodies):
        place = np.full(structure.n, -1)
        place[body.dofs] = np.arange(body.dofs.size)
        mine = np.flatnonzero(place[keep] >= 0)
        which, shapes = modes.of(i)
        if not mine.size:
            continue
        solve = _static_solve(body, shapes[:, modes.squares[which] == 0], say)
        for first in range(0, mine.size, BLOCK):
            some = mine[first : first + BLOCK]
            load = np.zeros((body.dofs.size, some.size), dtype=kind)
            load[place[keep[some]], np.arange(some.size)] = 1.0
            R[np.ix_(body.dofs, some)] = _answer(body, solve, shapes, load)
    return R


def _static_solve(body: Body, rigid: Matrix, say: Say) -> Solve:
    """Return the static solver for loads in equilibrium; in a free body, as many dofs are fixed as it has rigid motions."""
    if body.shift == 0:
        return body.solve
    order = scipy.linalg.qr(rigid.conj().T, mode="r", pivoting=True)[1]
    loose = np.sort(order[rigid.shape[1] :])  # the first ones determine the rigid motions best
    inner = factorise(submatrix(body.stiffness, loose, loose), say=say)

    def solve(load: Matrix) -> Matrix:
        answer = np.zeros_like(load)
        answer[loose] = inner(load[loose])
        return answer

    return solve


def _answer(body: Body, solve: Solve, shapes: Matrix, load: Matrix) -> Matrix:
    """Return the static response to `load` without the response of the modes `shapes`."""
    heavy = body.mass @ shapes
    answer = solve(load - heavy @ (shapes.conj().T @ load))
    return np.asarray(answer - shapes @ (heavy.conj().T @ answer))


def _basis(
    structure: Structure, keep: IntArray, bodies: Sequence[Body], modes: BodyModes, flexibility: Matrix
) -> Matrix:
    """Return ``[I 0; Δ Φ_del − Δ Φ_ret]`` (eq. 58)."""
    k, m = keep.size, modes.squares.size
    basis = np.zeros((structure.n, k + m), dtype=flexibility.dtype)
    retained = flexibility[keep]
    inverse = _inverse_at_keep(structure, keep, (retained + retained.conj().T) / 2)
    basis[:, :k] = flexibility @ inverse
    for i, body in enumerate(bodies):
        mine, shapes = modes.of(i)
        basis[np.ix_(body.dofs, k + mine)] = shapes
    basis[:, k:] -= basis[:, :k] @ basis[keep, k:]
    basis[keep] = 0.0
    basis[keep, np.arange(k)] = 1.0
    return basis


def _inverse_at_keep(structure: Structure, keep: IntArray, retained: Matrix) -> Matrix:
    """Return ``R_ret⁻¹``; refuse a matrix that is singular because the kept modes describe a motion of kept dofs completely."""
    diagonal = np.diag(retained).real
    lowest = DEPENDENT * np.max(diagonal, initial=0.0)
    lacking = np.flatnonzero(diagonal <= lowest)
    if lacking.size:
        raise _no_residual(structure, keep[lacking])
    scale = 1 / np.sqrt(diagonal)
    values, vectors = np.linalg.eigh(scale[:, None] * retained * scale)
    if keep.size and values[0] <= DEPENDENT:
        share = np.abs(vectors[:, 0])
        worst = np.argsort(-share)[:NAMED]
        raise _no_residual(structure, keep[worst[share[worst] > 0.1 * share[worst[0]]]])
    scaled = scale[:, None] * vectors
    return (scaled / values) @ scaled.conj().T


def _no_residual(structure: Structure, dofs: IntArray) -> SingularError:
    labels = structure.dofs.labels
    names = ", ".join(labels[d] for d in dofs[:NAMED]) + (" ..." if dofs.size > NAMED else "")
    return SingularError(
        f"rubin: kept dofs {names}: the residual flexibility is singular, the modes already describe all that these "
        "dofs do together. Keep fewer modes or fewer dofs there, or use craig_bampton"
    )
