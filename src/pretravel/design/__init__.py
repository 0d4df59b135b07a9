"""Wing: design a probe. Finite elements, friction at the seats, studies, probes from maps."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
