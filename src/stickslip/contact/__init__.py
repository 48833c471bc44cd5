"""What happens at a contact point: laws, their evaluation over a period, and where the points are."""
