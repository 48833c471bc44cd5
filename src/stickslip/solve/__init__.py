"""Generic numerics for ``F(x, p) = 0``: Newton and continuation; no physics."""
