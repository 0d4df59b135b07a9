"""Run a study, or show the results of an earlier one; list the studies of the package."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
