"""One file per file format read or written."""
