"""Placement of a part from its touches."""
