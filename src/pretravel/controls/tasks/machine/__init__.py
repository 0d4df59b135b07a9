"""Make a machine file to edit: probe, feeds, safe height, work offset."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
