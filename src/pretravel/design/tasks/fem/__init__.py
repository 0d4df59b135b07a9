"""The finite-element model of a described probe, and its state at the trigger in a direction."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
