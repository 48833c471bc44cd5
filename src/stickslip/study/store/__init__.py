"""Files of a run; none is ever partly written."""
