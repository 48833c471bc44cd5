"""What backs the claims: benchmarks, validation, strategies compared, figures, and the models they share."""
