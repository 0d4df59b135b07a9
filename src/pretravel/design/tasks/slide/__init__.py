"""Follow one touch step by step: how the tip slides from first contact to the trigger."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
