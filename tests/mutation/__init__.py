"""Single faults are put into the code; the tests must notice them. See `run`."""
