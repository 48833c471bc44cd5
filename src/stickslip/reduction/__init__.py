"""Reduction of linear structures to the coordinates that contacts, loads and outputs need."""
