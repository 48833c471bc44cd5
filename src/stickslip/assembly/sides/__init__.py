"""What vibrates: a sector wave by wave, a wheel whose sectors differ, a range of speeds, an unreduced model."""
