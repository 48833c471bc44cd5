"""Readers of models and matrices from other programs; none executes any content of a file."""
