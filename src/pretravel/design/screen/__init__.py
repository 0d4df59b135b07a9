"""The designer's screen of the workbench."""
