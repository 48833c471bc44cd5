"""What a model can and cannot do, told without solving its response: damping, bounds by friction, bodies on contacts alone."""
