"""Physical limits of a response, and what the model itself changes in it."""
