"""Elasticity: what gives, and by how much."""
