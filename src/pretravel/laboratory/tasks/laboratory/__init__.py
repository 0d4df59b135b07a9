"""Print what a laboratory states in reports and certificates, to fill in."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
