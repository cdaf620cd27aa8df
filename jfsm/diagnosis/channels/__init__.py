"""What sensors do to a record that is no motion: clipping, delays, drift, coloured noise."""
