"""The monodromy matrix: disturbances carried over a period."""
