"""Place and direction of a rotary axis from touches of a sphere at several angles."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
