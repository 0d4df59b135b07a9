"""Compare the errors after each correction of a map; or the designs of two probes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
