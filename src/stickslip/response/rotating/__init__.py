"""Frequencies over the rotor speed: Campbell diagrams, nodal diameters, interference."""
