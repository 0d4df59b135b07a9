"""What any log of touches of one point says: noise, drift, first touch, the next touch."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
