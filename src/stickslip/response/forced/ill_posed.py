"""Refusal of systems that have no forced response."""

import numpy as np

from stickslip.errors import input_error
from stickslip.response.system import System


def refuse_ill_posed(system: System) -> None:
    """Refuse a system without unknowns, and masses that are negative."""
    if not system.retained.size:
        raise input_error(
            "System.interface",
            "touches no dof that can move: nothing is left to solve for",
            "Let a contact touch a free dof; without contacts the response is linear.",
        )
    structure = system.structure.of_harmonic(0)
    mass = structure.mass.diagonal().real
    if np.any(mass < 0):
        dof = int(np.argmin(mass))
        raise input_error(
            "System.structure",
            f"has the mass {mass[dof]:.6g} at {structure.dofs.labels[dof]}",
            "A mass matrix is positive definite: check its source.",
        )
