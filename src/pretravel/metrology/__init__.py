"""From measured touches to maps and compensated points."""
