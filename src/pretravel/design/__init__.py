"""Design: the probe that fits a wish best, within ranges and limits."""
