"""Motions with two frequencies, and what is not periodic at all."""
