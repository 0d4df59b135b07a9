"""Friction at the seats, and what it does to the trigger."""
