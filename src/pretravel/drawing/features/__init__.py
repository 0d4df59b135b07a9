"""Features of parts: association, form, uncertainty, conformity."""
