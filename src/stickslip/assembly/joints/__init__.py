"""Contacts and joins of a model: pairs of points, their frames and laws, ties, and unconstrained bodies."""
