"""Craig-Bampton reduction, and a second reduction of interface dofs to characteristic constraint modes.

R. R. Craig and M. C. C. Bampton, "Coupling of substructures for dynamic analyses", AIAA Journal 6 (1968) 1313-1319.
M. P. Castanier, Y.-C. Tan and C. Pierre, "Characteristic constraint modes for component mode synthesis", AIAA Journal 39
(2001) 1182-1187.
"""

import math
from dataclasses import replace

import numpy as np

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import Say, silent
from stickslip.model.modes import submatrix
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_basis, kept_dofs, surviving_sets, with_modal_dofs
from stickslip.reduction.bodies import (
    Body,
    BodyModes,
    bodies_fixed_at,
    fill_constraint_modes,
    loose_bodies,
    lowest_of,
    modes_up_to,
)
from stickslip.reduction.truncation import (
    FrequencyError,
    FrequencyErrors,
    ModeChoice,
    ModesBelow,
    enough_modes,
    errors_of,
    frequencies_below,
)

AHEAD = 1.5  # modes computed over modes needed now: the next two or three steps use the surplus


def craig_bampton(structure: Structure, keep: IntArray, n_modes: ModeChoice, *, say: Say = silent) -> Structure:
    """Reduce to the kept dofs and the lowest modes with those dofs fixed.

    Parameters
    ----------
    structure
        Full model, dense or sparse, real symmetric or complex Hermitian (a travelling wave). Supports or `keep` must
        prevent rigid motion.
    keep
        (k,) indices of the dofs that stay physical: contact, excitation, output. An empty array keeps the lowest
        modes of a supported structure only: modal truncation.
    n_modes
        Number of fixed-interface modes, `ModesBelow` a frequency, or a `FrequencyError` to meet.
    say
        Called with a sentence before each long step.

    Returns
    -------
    Structure
        Dense, with coordinates ``(u_keep [m], modal [√kg m])``. Sets whose dofs are all kept
        survive in their order; ``modes`` holds the modal coordinates. `basis` leads back.

    Raises
    ------
    InputError
        If `keep` or `n_modes` does not fit the structure, or an error needs too many modes.
    SingularError
        If the stiffness with `keep` fixed is singular: a body can move rigidly.

    Notes
    -----
    ``u = [I 0; Ψ Φ] q`` with constraint modes ``Ψ = −K_ii⁻¹ K_ik`` and mass-normalised
    fixed-interface modes ``Φ``. Exact in statics for loads on `keep`; frequencies converge from
    above. The basis is orthogonal in stiffness: ``K_reduced = diag(K_kk + K_ki Ψ, ω²)``.
    """
    keep = kept_dofs("craig_bampton", structure, keep)
    if isinstance(n_modes, int | np.integer) and not 0 <= n_modes <= structure.n - keep.size:
        raise input_error(
            "craig_bampton: n_modes",
            f"got {n_modes}, and {structure.n - keep.size} dofs are not kept",
            "Ask for at most that many.",
        )
    bodies = bodies_fixed_at(structure, keep, "craig_bampton: with the kept dofs fixed", say)
    return fixed_interface_reduction(structure, keep, bodies, n_modes, say)


def fixed_interface_reduction(
    structure: Structure, keep: IntArray, bodies: list[Body], n_modes: ModeChoice, say: Say
) -> Structure:
    """Return the reduction of `craig_bampton`, given the bodies that remain when `keep` is fixed."""
    if isinstance(n_modes, FrequencyError):
        return _until_exact_enough(structure, keep, bodies, n_modes, say)
    if isinstance(n_modes, ModesBelow):
        modes = modes_up_to(bodies, 2 * math.pi * n_modes.factor * n_modes.up_to_hz, say)
    else:
        modes = lowest_of(bodies, n_modes, say)
    basis = _basis(structure, keep, bodies, modes, say=say)
    return _on_model(structure, _reduced(structure, keep, basis, modes), basis)


def _basis(
    structure: Structure,
    keep: IntArray,
    bodies: list[Body],
    modes: BodyModes,
    *,
    static: Matrix | None = None,
    say: Say,
) -> Matrix:
    """Return ``[I 0; Ψ Φ]``; `static` holds the constraint modes if they are known."""
    k = keep.size
    kinds = [structure.stiffness.dtype, float, *(shapes.dtype for shapes in modes.shapes)]
    basis = np.zeros((structure.n, k + modes.squares.size), dtype=np.result_type(*kinds))
    if static is None:
        fill_constraint_modes(structure, keep, bodies, basis[:, :k], say)
    else:
        basis[:, :k] = static
    for i, body in enumerate(bodies):
        mine, shapes = modes.of(i)
        basis[np.ix_(body.dofs, k + mine)] = shapes
    return basis


def _reduced(structure: Structure, keep: IntArray, basis: Matrix, modes: BodyModes) -> Structure:
    """Return the reduced structure without its `basis`."""
    k, m = keep.size, modes.squares.size
    stiffness = np.zeros((k + m, k + m), dtype=basis.dtype)
    stiffness[:k, :k] = in_basis(structure.stiffness, basis[:, :k])
    stiffness[k:, k:] = np.diag(modes.squares)
    return Structure(
        in_basis(structure.mass, basis),
        in_basis(structure.damping, basis),
        stiffness,
        with_modal_dofs(structure.dofs.take(keep), m),
        surviving_sets(structure, keep) | {"modes": np.arange(k, k + m)},
        loss=None if structure.loss is None else in_basis(structure.loss, basis),
    )


def _on_model(structure: Structure, reduced: Structure, basis: Matrix) -> Structure:
    return replace(reduced, basis=structure.expand(basis))


def _until_exact_enough(
    structure: Structure, keep: IntArray, bodies: list[Body], choice: FrequencyError, say: Say
) -> Structure:
    """Add modes until the estimated errors of the reduced frequencies suffice."""
    modes = modes_up_to(bodies, 2 * math.pi * choice.up_to_hz, say, choice.most)
    available = sum(body.heavy for body in bodies)
    below = frequencies_below(structure, choice.up_to_hz, say)
    basis = _basis(structure, keep, bodies, modes, say=say)
    found, known = (_reduced(structure, keep, basis, modes), basis), modes

    def errors(count: int) -> FrequencyErrors:
        nonlocal known, found
        if count > found[0].n - keep.size:
            if count > known.squares.size:
                ahead = max(count, min(math.ceil(AHEAD * count), choice.most))
                known = lowest_of(bodies, ahead, say)
            modes = known.first(count)
            static = found[1][:, : keep.size]
            basis = _basis(structure, keep, bodies, modes, static=static, say=say)
            found = (_reduced(structure, keep, basis, modes), basis)
        return errors_of(structure, *found, bodies, choice.up_to_hz, below)

    enough_modes(choice, modes.squares.size, available, errors, say)
    return _on_model(structure, *found)


PLACE = "reduce_interface"


def reduce_interface(structure: Structure, interface: IntArray, n_modes: ModeChoice, *, say: Say = silent) -> Structure:
    """Replace interface dofs of a reduced structure by its characteristic constraint modes.

    Parameters
    ----------
    structure
        Result of `craig_bampton` or `rubin`, real or of a travelling wave.
    interface
        (c,) dofs to replace: cut faces and joints that stick. Leave out dofs that contact laws need; these stay
        physical, and the response to static forces on them stays exact.
    n_modes
        Number of characteristic modes, `ModesBelow` a frequency, or a `FrequencyError` to meet.
    say
        Called with a sentence before each long step.

    Returns
    -------
    Structure
        Dense, with the other coordinates in their order, then the characteristic modes [√kg m], the set ``interface_modes``.
        Sets without replaced dofs survive. `basis` leads back to the full model.

    Raises
    ------
    InputError
        If `interface` or `n_modes` does not fit the structure, modal coordinates are to be replaced, or an error
        needs too many modes.
    SingularError
        If the replaced dofs can move rigidly when the others are fixed.

    Notes
    -----
    A Craig-Bampton reduction of the reduced structure: ``u_c = Ψ u_a + Φ η`` with the other coordinates a kept,
    ``Ψ = −K_cc⁻¹ K_ca`` and Φ the lowest modes of ``K_cc, M_cc``, which contain the statically condensed interior. If no
    nodal coordinate remains, Φ are the characteristic constraint modes of the paper, including rigid motions.
    `frequency_errors` estimates the loss of accuracy.
    """
    interface = kept_dofs(PLACE, structure, interface)
    modal = [i for i in interface if structure.dofs.component[i] == "mode"]
    if modal:
        raise input_error(
            f"{PLACE}: interface",
            f"coordinate {modal[0]} is modal",
            "Give nodal dofs; the number of component modes is chosen in the first reduction.",
        )
    if isinstance(n_modes, int | np.integer) and not 0 <= n_modes <= interface.size:
        raise input_error(
            f"{PLACE}: n_modes", f"got {n_modes} for {interface.size} interface dofs", "Ask for at most that many."
        )
    others = np.setdiff1d(np.arange(structure.n), interface)
    bodies = _interface_bodies(structure, interface, others, say)
    reduced = fixed_interface_reduction(structure, others, bodies, n_modes, say)
    sets = dict(reduced.sets)
    sets["interface_modes"] = sets.pop("modes")
    if "modes" in structure.sets:
        sets["modes"] = np.searchsorted(others, structure.sets["modes"])
    return replace(reduced, sets=sets)


def _interface_bodies(structure: Structure, interface: IntArray, others: IntArray, say: Say) -> list[Body]:
    """Return the bodies of the interface with the other coordinates fixed; without static coupling to these it may be free."""
    if not abs(submatrix(structure.stiffness, interface, others)).max(initial=0.0):
        return loose_bodies(structure, interface, say)
    return bodies_fixed_at(structure, others, f"{PLACE}: with the other dofs fixed", say)
