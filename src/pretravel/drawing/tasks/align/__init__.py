"""Align a part: where it lies in the machine, from touches on its faces."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
