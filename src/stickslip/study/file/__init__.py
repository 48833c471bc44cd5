"""The study file: its tables, and the errors in it."""
