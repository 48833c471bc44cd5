"""Readers of the models and matrices that other programs write; none executes what it reads."""
