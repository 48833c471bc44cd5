"""The models that benchmarks, validation, strategies, figures and tests share."""
