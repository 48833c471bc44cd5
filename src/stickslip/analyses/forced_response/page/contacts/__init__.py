"""Figures of the contacts and rigid bodies of a response."""
