"""Bounds over residual tractions: table, question, records, dataset and words."""
