"""The demonstration: the way of a measurement, from touches on a sphere to a bore."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
