"""Verify a probe: touches on a reference against its map, and its history."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
