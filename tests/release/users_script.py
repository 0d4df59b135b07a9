"""A program of a user, for type checkers: it sees the installed package alone.

Each assignment states the type that a checker must find.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import pretravel


def compensated(path: str) -> pretravel.Points:
    sphere: pretravel.Touches = pretravel.read_touches(path)
    probe: pretravel.Qualification = pretravel.qualify(sphere, diameter=25.0, tip_diameter=6.0)
    pretravel_map: pretravel.PretravelMap = probe.pretravel_map
    values: npt.NDArray[np.float64] = pretravel_map.pretravel([[1.0, 0.0, 0.0]])
    print(f"{float(values[0]) * 1e3:.1f} µm, kind {pretravel_map.kind.upper()}")
    points: pretravel.Points = pretravel.apply(sphere, pretravel_map)
    lengths: list[int] = [len(label) for label in points.labels]
    print(sum(lengths), pretravel.__version__.partition("+")[0])
    return points


def predicted(name: str) -> float:
    trigger: pretravel.Trigger = pretravel.predict(pretravel.load_probe(name), np.eye(3))
    try:
        units: object = trigger.to_xarray()["pretravel"].attrs["units"]
        print(units)
    except pretravel.PretravelError as error:
        print(error)
    return float(trigger.force[0])
