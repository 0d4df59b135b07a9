"""Results for people: words, pictures, pages."""
