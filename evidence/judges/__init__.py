"""Independent judges: programs that share no code with src and say what the right answer is."""
