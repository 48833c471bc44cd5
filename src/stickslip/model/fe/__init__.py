"""Finite elements: solids, beams, prestress, rotation, and solvers for their matrices."""
