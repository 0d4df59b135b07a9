"""Load and unload a probe with friction at the seats: hysteresis, reseat error, zero drift."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
