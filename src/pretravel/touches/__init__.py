"""Touches, the first shared type: what a machine reports, and the targets of touches to come."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
