"""Forced responses from one nonlinear mode: table, problem, records, verdicts."""
