"""Study files in, datasets out: the only place with pydantic and xarray."""
