"""Unreduced models: condition under which nothing is condensed, and refusals of analyses that need a reduced model."""

import numpy as np
import scipy.sparse

from stickslip.arrays import Matrix
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.locations import stacked
from stickslip.assembly.model import Model
from stickslip.contact.law import Rigid
from stickslip.contact.laws import law_name
from stickslip.errors import input_error
from stickslip.harmonic.dynamic_stiffness import LARGEST_INTERIOR
from stickslip.harmonic.linear import LinearSide
from stickslip.harmonic.sparse_stiffness import Unreduced
from stickslip.model.structure import Structure

KEPT = 'reduction.method = "none" keeps parts whole'
INSTEAD = "take [forced_response], which solves for all dofs"


def as_it_is(structure: Structure, gaps: Matrix) -> LinearSide:
    """Return an unreduced structure as `Unreduced` if it has too many dofs for condensation.

    `gaps` (3 p, n) are its contacts' gaps.
    """
    if structure.is_complex or not scipy.sparse.issparse(structure.stiffness):
        return structure
    interior = structure.n - np.unique(gaps.nonzero()[1]).size
    return Unreduced(structure) if interior > LARGEST_INTERIOR else structure


def kept_whole(model: Model) -> int:
    """Return the approximate number of dofs of an uncondensed model before it is assembled; 0 for a condensed one."""
    dofs, interior = _dofs(model)
    return dofs if interior > LARGEST_INTERIOR else 0


def _dofs(model: Model) -> tuple[int, int]:
    """Return the number of dofs of unreduced parts, and the number of these that touch no contact."""
    if model.neighbours is not None:
        return 0, 0
    whole = [
        model.places.own(name)
        for name, part in model.parts.items()
        if part.body is None and (part.template or part).reduction is None
    ]
    dofs = stacked(whole)
    interior = np.setdiff1d(dofs, model.pairs.own.nonzero()[1])
    return dofs.size, interior.size


def refuse_rigid(model: Model, side: LinearSide) -> None:
    """Refuse rigid contacts of an uncondensed model.

    Raises
    ------
    InputError
        If a contact is rigid. The message names it.
    """
    rigid = [n for n, one in model.contacts.items() if isinstance(one.law, Rigid)]
    if rigid and not side.reduced:
        raise input_error(
            f"contact.{rigid[0]}.law",
            f"is {law_name(model.contacts[rigid[0]].law)}, which needs a reduced model: {KEPT}",
            'Reduce the parts (method = "craig_bampton"), or give the contact a stiffness, such as elastic_coulomb.',
        )


def refuse_whole(analysis: str, model: Model, instead: str = INSTEAD) -> None:
    """Refuse a model that would not be condensed, before it is assembled.

    Raises
    ------
    InputError
        If the model would not be condensed. The message names the `analysis` and the remedy `instead`.
    """
    dofs, interior = _dofs(model)
    if interior <= LARGEST_INTERIOR:
        return
    raise input_error(
        analysis,
        f"needs a reduced model: {KEPT}, and {interior} of {dofs} dofs touch no contact, more than {LARGEST_INTERIOR}",
        f'Reduce the parts (method = "craig_bampton"), or {instead}.',
    )


def unreduced_line(model: Assembled) -> tuple[str, ...]:
    """Return a line about the solution of an uncondensed model; empty for a condensed one."""
    if model.system.structure.reduced:
        return ()
    text = (
        f"nothing is condensed: {KEPT}, all {model.system.structure.n} dofs are unknown in each harmonic. Their matrices stay sparse, Newton "
        "steps are solved by a Krylov method with one sparse factor. Stability and time integration need a reduced model"
    )
    return (text,)
