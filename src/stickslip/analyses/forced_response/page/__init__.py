"""Figures and tables of forced responses, each a function of a `Response`."""
