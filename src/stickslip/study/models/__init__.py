"""From the tables of a study to a model."""
