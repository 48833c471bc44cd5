"""Limit cycles of a model: its table, what is solved, what is told of it."""
