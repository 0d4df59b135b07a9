"""Checks by published standards."""
