"""The search for two blades and a damper that test the statements of Gastaldi & Berruti: what their paper does not give is varied."""
