"""The forced response: branches, repeats with more harmonics, peaks."""
