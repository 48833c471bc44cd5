"""Motion in time: integration, shooting, Floquet multipliers."""
