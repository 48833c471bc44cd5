"""The study file: its tables, and what is wrong with one."""
