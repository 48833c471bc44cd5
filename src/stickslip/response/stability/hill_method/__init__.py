"""Hill's method: Floquet exponents from the harmonic balance."""
