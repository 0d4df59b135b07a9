"""Tasks on the machine: maps and programs for controls."""
