"""Tasks that decide a drawing."""
