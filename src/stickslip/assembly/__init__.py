"""Parts, contacts and loads put together: a model, and what it is to a solver."""
