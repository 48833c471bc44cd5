"""Motions with two frequencies of a model: the table, what is solved, what is told of it."""
