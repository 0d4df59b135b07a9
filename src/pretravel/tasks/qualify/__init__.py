"""Qualify a probe: touches on a reference, from files, to a map and its report."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
