"""Monodromy matrix: propagation of disturbances over a period."""
