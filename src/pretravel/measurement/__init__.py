"""Touches and a map in, surface points with uncertainties out."""
