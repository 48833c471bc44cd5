"""Steps of laws that call their own compiled functions; importing one imports numba."""
