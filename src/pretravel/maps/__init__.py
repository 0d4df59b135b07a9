"""The second shared type: pretravel over directions, and the kinds of map there are."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
