"""The compiled time step, and what it is made of."""
