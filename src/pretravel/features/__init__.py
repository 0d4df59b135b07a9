"""Features of a part from compensated points: form, size, position, conformity."""
