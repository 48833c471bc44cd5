"""Resonance peaks followed over design parameters as solutions of equations, including subharmonic ones."""
