"""The analysis of the forced response: table, points, checks, dataset."""
