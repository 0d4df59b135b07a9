"""Tasks of the laboratory."""
