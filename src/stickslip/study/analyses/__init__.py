"""The questions that a study asks, one file each."""
