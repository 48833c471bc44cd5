"""The tables of a study file that describe the model: parts, materials, contacts, loads."""
