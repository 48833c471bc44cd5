"""Two trees of sources, one machine: every example study gives the same numbers and the same words."""
