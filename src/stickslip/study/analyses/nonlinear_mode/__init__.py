"""Nonlinear modes of a model: their table, what is solved, what is told of them."""
