"""What a task is: settings, run, result, and what all tasks share. `listed` has all tasks."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
