"""What a run keeps on the disk, whole whenever it is stopped."""
