"""Steps of laws that call compiled functions of their own; whoever loads one loads numba."""
