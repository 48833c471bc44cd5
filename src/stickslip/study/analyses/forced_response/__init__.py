"""What the analysis of the forced response is made of: its table, its points in order, its checks, its dataset."""
