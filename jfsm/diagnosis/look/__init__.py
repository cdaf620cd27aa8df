"""What is looked at before any hypothesis: dead, torn and resting channels, signs, sizes, and what drives."""
