"""Isotropic planar Coulomb friction over one period, by located events and collocation of the angle of slip."""
