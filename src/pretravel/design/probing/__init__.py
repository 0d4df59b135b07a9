"""A probe touches a surface.

tip is the probe at the contact. touching solves touches without steps (surface_touches holds the
result), slides step by step; obstacles finds faces in the way; simulation makes the touches that a
machine reports.
"""
