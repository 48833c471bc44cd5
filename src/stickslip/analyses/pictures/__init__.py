"""Pictures of the model: its skin, contact patches and mode shapes."""
