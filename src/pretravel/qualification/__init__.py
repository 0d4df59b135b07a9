"""Touches on a reference sphere or ring in, a map of the probe out."""
