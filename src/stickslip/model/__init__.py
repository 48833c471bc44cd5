"""Structures: blades of finite elements, rigid dampers, lumped masses, damping and modes."""
