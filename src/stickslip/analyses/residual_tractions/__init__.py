"""Bounds over residual tractions: table, problem, records, verdicts."""
