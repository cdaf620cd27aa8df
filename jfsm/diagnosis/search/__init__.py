"""Which hypotheses are fitted, in what order, and when to stop."""
