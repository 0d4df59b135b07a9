"""Qualification with a harmonic map, on a reference without uncertainty: for tests by hand."""

from __future__ import annotations

from typing import Any

from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches

_PLAIN = {"kind": "harmonic", "u_diameter": 0.0, "u_temperature": 0.0, "sphere_form": 0.0}


def qualify_plainly(touches: Touches, diameter: float, **options: Any) -> Qualification:
    """As `pretravel.qualify`; options that are given replace the plain ones."""
    return qualify(touches, diameter, **(_PLAIN | options))
