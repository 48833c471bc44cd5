"""Stability of a response: which points are examined, and motions in time beside them."""
