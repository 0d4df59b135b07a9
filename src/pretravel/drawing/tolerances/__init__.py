"""Datum systems and tolerances of drawings."""
