"""To the machine: programs that probe, and maps as tables and macros of controls."""
