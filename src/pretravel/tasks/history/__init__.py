"""The history of a probe: a folder of touches, one file a day, or the file of its verifications."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
