"""What to measure next, and the smallest effect that a record would have shown."""
