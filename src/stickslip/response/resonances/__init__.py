"""Resonance peaks as equations: followed over design parameters, subharmonic ones among them, and the highest of several."""
