"""Rigid bodies and dampers."""
