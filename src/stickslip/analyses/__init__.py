"""The analyses of a study, one folder each, and the page of a result."""
