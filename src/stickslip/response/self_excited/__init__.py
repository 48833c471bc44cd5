"""Vibration that nothing drives: limit cycles of unstable waves that friction bounds, and what becomes of disturbances of them."""
