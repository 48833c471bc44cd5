"""Records of the analyses by waves, and their datasets."""
