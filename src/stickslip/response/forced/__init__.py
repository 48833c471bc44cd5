"""Forced response: branches, repeats with more harmonics, peaks."""
