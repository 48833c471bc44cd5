"""Resonances: peaks as equations, followed over design parameters; those that the load does not drive; which of several is the highest."""
