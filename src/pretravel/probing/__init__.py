"""A probe touches a surface.

inspection chooses points, targets holds them; tip is the probe at the contact. touching solves
touches without steps (surface_touches holds the result), slide step by step; obstacles finds
faces in the way; simulation makes the touches that a machine reports.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
