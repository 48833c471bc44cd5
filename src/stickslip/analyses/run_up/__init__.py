"""The run-up: table, problem, values, verdicts."""
