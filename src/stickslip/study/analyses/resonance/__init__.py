"""Resonance peaks over a design parameter: the table, what is solved, what is told of it."""
