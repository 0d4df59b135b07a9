"""Elastic deformation of the probe: beams, contacts, finite elements."""
