"""What could be wrong: causes at places, and the values from which they are fitted."""
