"""The run-up: table, problem, solve, records, verdicts."""
