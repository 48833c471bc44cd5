"""Physical limits of a response, and the sensitivity of its peak to the model."""
