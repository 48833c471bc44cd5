"""Motions with two frequencies: table, problem, records, verdicts."""
