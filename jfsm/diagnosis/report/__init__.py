"""A decision put into values, words and plain data."""
