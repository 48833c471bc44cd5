"""The questions that a study may ask, one folder each, and the page of a result."""
