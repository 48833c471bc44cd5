"""Parts reduced, copied, and with more modes for comparison."""
