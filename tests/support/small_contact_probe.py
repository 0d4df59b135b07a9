"""A small contact probe with the figures of the program in Woźniak's Figure 2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe, Seats, StylusSegment, Tip, Tripod
from pretravel.prediction.materials import material

TIP_RADIUS = 2.0


def small_contact_probe(length: float, stem: str = "tungsten carbide") -> Probe:
    """Spring 0.6 N, seats 8 mm apart, stem 2 mm thick, ball of 4 mm, as his window shows; hub,
    seats at 30° and contact radii are assumed. Stylus of `length` mm."""
    carbide = material("tungsten carbide")
    return replace(
        load_probe("omp40-2"),
        tripod=Tripod(8.0 / np.sqrt(3.0), tuple(np.radians([0, 120, 240])), 1.0, carbide),
        seats=Seats(np.radians(30.0), 1.25, carbide),
        preload=0.6,
        hub_offset=4.0,
        hub=None,
        stylus=(StylusSegment(length, 2.0, material(stem)),),
        tip=Tip(TIP_RADIUS, material("ruby")),
    )
