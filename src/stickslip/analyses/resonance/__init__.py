"""Resonance peaks over a design parameter: table, problem, verdicts."""
