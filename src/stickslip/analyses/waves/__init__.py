"""Modes, Campbell and SAFE diagrams: travelling waves of a wheel, or a structure as a whole."""
