"""Physical limits of a model, found without its response: damping, the most that friction can do, parts held by contacts alone."""
