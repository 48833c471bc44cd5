"""All motions of a load: the table, what is searched, what is told of it."""
