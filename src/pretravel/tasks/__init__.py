"""One job a module: files and settings in, a result and its report out. Nothing is printed here."""
