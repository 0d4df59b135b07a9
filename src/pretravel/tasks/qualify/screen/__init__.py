"""The engineer's screen of the workbench."""
