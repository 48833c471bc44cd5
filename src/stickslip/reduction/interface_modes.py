"""A second reduction, of interface dofs: characteristic constraint modes.

M. P. Castanier, Y.-C. Tan and C. Pierre, "Characteristic constraint modes for component mode synthesis", AIAA Journal 39
(2001) 1182-1187.
"""

from dataclasses import replace

import numpy as np

from stickslip.arrays import IntArray
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import Say, silent
from stickslip.model.modes import submatrix
from stickslip.model.structure import Structure
from stickslip.reduction.basis import kept_dofs
from stickslip.reduction.bodies import Body, bodies_fixed_at, loose_bodies
from stickslip.reduction.fixed_interface import fixed_interface_reduction
from stickslip.reduction.truncation import ModeChoice

PLACE = "reduce_interface"


def reduce_interface(structure: Structure, interface: IntArray, n_modes: ModeChoice, *, say: Say = silent) -> Structure:
    """Replace interface dofs of a reduced structure by its characteristic constraint modes.

    Parameters
    ----------
    structure
        What `craig_bampton` or `rubin` returned, real or of a travelling wave.
    interface
        (c,) dofs to replace: cut faces and joints that stick. Leave out those that contact laws need; they stay
        physical, and the answer to static forces on them stays exact.
    n_modes
        Number of characteristic modes; or `ModesBelow` a frequency; or `FrequencyError`: as many as it takes.
    say
        Called with a sentence before each long step.

    Returns
    -------
    Structure
        Dense, with the other coordinates in their order, then the characteristic modes [√kg m], which are the set
        ``interface_modes``. Sets without replaced dofs survive. `basis` leads back to the full model.

    Raises
    ------
    InputError
        If `interface` or `n_modes` does not fit the structure, modal coordinates are to be replaced, or an error would
        take too many modes.
    SingularError
        If the replaced dofs are not held when the others are fixed.

    Notes
    -----
    A Craig-Bampton reduction of the reduced structure: ``u_c = Ψ u_a + Φ η`` with the other coordinates a kept,
    ``Ψ = −K_cc⁻¹ K_ca`` and Φ the lowest modes of ``K_cc, M_cc``, matrices into which the interior was condensed
    statically. Where no nodal coordinate is left, Φ are the characteristic constraint modes of the paper, and rigid
    motions are among them. What is lost, `frequency_errors` estimates.
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
    bodies = _bodies(structure, interface, others, say)
    reduced = fixed_interface_reduction(structure, others, bodies, n_modes, say)
    sets = dict(reduced.sets)
    sets["interface_modes"] = sets.pop("modes")
    if "modes" in structure.sets:
        sets["modes"] = np.searchsorted(others, structure.sets["modes"])
    return replace(reduced, sets=sets)


def _bodies(structure: Structure, interface: IntArray, others: IntArray, say: Say) -> list[Body]:
    """Return the interface with the others fixed; it may be free where nothing static joins it to them."""
    if not abs(submatrix(structure.stiffness, interface, others)).max(initial=0.0):
        return loose_bodies(structure, interface, say)
    return bodies_fixed_at(structure, others, f"{PLACE}: with the other dofs fixed", say)
