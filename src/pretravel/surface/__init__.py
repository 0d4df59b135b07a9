"""Surfaces of parts: geometry without probes, used by the virtual and by the measured branch.

local_geometry contains the protocol of a surface. The surfaces are in shapes and
shapes_of_revolution (with placed_shape), parametric, spline and swept (with curves); cad reads
those of STEP files. contact and search find where a ball touches; specification makes surfaces
from text.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
