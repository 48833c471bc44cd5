"""The Python interface: models, studies and results."""
