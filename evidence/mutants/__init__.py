"""Would the tests notice? One-point mutants of the library, drawn by a seed, and the tests that reach them."""
