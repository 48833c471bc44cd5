"""The figures of Gastaldi & Berruti (2017) on this package's own two blades, and what becomes of the paper's statements."""
