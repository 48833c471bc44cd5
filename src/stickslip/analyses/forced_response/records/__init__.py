"""The points of a response as records and as variables of the dataset."""
