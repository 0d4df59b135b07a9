"""Evaluate touches at 0° and 180° of the spindle: means without run-out and odd lobes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
