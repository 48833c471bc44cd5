"""The questions engineers ask, as functions of a system and a load."""
