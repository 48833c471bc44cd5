"""What a Python user holds: models, studies and results."""
