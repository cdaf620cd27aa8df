"""What follows from the evidence: a pure function of scorecards and thresholds."""
