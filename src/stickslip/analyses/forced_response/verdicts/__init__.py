"""Verdicts on a response: rules on its finished dataset."""
