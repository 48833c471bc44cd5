"""Linear sides of a model: a sector wave by wave, a mistuned wheel, a range of speeds, an unreduced model."""
