"""The compiled time step and its parts."""
