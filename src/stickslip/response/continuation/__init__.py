"""Continuation of periodic motions with adaptive harmonics."""
