"""Finite elements: solids, beams, prestress, rotation, and what solves with their matrices."""
