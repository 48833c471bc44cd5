"""What the page says of each analysis, one file each."""
