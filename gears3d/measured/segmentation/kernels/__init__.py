"""Inner loops of measuring, compiled."""
