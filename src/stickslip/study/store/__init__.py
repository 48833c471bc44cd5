"""Files of a run; all writes are atomic."""
