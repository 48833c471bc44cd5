"""Meshes: shapes that gmsh meshes, and meshes of any source."""
