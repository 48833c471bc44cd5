"""Whether what a forced response trusts is right and stable: random systems with a generator and a judge of their own."""
