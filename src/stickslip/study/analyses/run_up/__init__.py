"""The run-up: its table, what a job is given, its numbers and its words."""
