"""Nonlinear modes: table, problem, records, verdicts."""
