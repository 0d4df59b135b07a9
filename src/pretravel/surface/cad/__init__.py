"""Parts from STEP files: faces as surfaces, with their edges."""
