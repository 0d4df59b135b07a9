"""Separate machine and probe: multi-step readings to errors and variances; the plan of a test."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
