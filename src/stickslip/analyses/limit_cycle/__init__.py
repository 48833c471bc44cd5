"""Limit cycles: table, problem, records, verdicts."""
