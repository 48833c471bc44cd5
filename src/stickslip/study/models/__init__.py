"""Study tables turned into models."""
