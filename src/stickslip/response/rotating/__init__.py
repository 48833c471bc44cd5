"""Frequencies over the speed: Campbell, nodal diameters, interference."""
