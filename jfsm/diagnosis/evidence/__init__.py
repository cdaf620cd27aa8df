"""What each hypothesis is worth: what was measured about it, as plain numbers."""
