"""pretravel: predict, calibrate and compensate the pretravel of touch-trigger probes.

The public names are listed in ``__init__.pyi``; each is imported when it is first used, so that
importing the package costs nothing.
"""

from __future__ import annotations

import sys

if getattr(sys, "argv", [])[:1] == ["-m"] and not sys.flags.safe_path:
    # python -m pretravel: a typing.py or shutil.py next to a part file must not be imported. A
    # program in the current folder that imports pretravel has the modules next to it.
    _started = sys.orig_argv[-len(sys.argv)].partition(".")[0]  # "pretravel" or "-mpretravel"
    if _started == "pretravel" or (_started[:1] == "-" and _started.endswith("mpretravel")):
        del sys.path[0]

from typing import Any

import lazy_loader

from pretravel.base import forms, plainly_shown

_load, _names, _listed = lazy_loader.attach_stub(__name__, __file__)
__all__ = ["__version__", *_listed]

forms.register("card", "pretravel.task.notebook_card:notebook_html")
forms.register("plot", "pretravel.task.plots:plotted")
forms.register("dataframe", "pretravel.files.other_libraries:dataframe")
forms.register("dataset", "pretravel.files.other_libraries:dataset")
forms.register("touches", "pretravel.files.readings:touches_meant")
forms.register("points", "pretravel.files.points_reading:read_points")
forms.register("map", "pretravel.files.map_file:read_map")


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from pretravel.base import installed_version

        return installed_version()
    return plainly_shown(_load(name))


def __dir__() -> list[str]:
    return sorted(__all__)
