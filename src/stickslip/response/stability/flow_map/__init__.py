"""The monodromy matrix: propagation of disturbances over a period."""
