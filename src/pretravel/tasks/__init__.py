"""The tasks of the core, a folder each: task, report, and screen where it has one of its own."""
