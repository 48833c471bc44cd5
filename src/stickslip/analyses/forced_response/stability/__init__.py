"""Stability of a response: choice of points, examination, and time integration."""
