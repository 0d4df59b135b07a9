"""Calibrate a probe on a rig: traces to pretravel and hysteresis, their report and certificate."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
