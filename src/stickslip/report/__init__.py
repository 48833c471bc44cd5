"""A dataset in, one HTML page out; never calls a solver."""
