"""Surfaces of parts: geometry alone."""
