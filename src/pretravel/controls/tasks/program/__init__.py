"""Make probing programs for LinuxCNC: on a sphere, on a part, and subroutines to call by hand."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
