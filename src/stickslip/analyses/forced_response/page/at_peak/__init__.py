"""Figures of the peak of each case: contacts, bodies, their motion, T/N."""
