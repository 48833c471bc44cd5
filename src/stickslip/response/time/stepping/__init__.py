"""Compiled time step and its parts."""
