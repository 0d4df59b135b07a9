"""The calibration laboratory: rig, separation of machine and probe, standards, certificate."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
