"""Export of results to other programs: fields on all nodes, states of contacts, response functions."""
