"""A tripod on six seats as a dozen numbers: its map, and the kind `physical` that is fitted to touches."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
