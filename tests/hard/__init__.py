"""Hard use: every reader with mutated files. `python -m tests.hard.run --help`."""
