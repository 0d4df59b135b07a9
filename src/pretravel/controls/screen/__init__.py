"""The engineer's screen of the workbench: qualify a probe, and make the files of a control."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
