"""Forced responses of one nonlinear mode: the rooms of the analysis `modal_synthesis`."""
