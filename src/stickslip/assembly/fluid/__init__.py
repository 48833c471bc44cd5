"""Forces of a fluid on a model: aerodynamic coefficients and pressure fields."""
