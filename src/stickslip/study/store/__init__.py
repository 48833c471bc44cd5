"""Files of a run, whole whenever it is stopped."""
