"""Results of an earlier commit, kept, and whether today's code still gives them."""
