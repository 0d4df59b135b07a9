"""The files of maps, in memory."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import Any

import numpy as np

from pretravel.files.map_json import json_of_map, map_from_json
from pretravel.files.source_file import SourceFile
from pretravel.maps.kinds.averaged import averaged_map
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map, lobes, made_up_map

stored = json_of_map
"""The content of the file of a map; the same for two maps that are equal in all they contain."""


def map_of(content: bytes) -> PretravelMap:
    return map_from_json(SourceFile("map.json", content))


def sealed(content: dict[str, Any]) -> bytes:
    """The text of changed content with a digest that fits, as docs/formats.md states it."""
    own = {name: value for name, value in content.items() if name != "content_sha256"}
    canonical = json.dumps(own, sort_keys=True, separators=(",", ":"))
    digest = hashlib.sha256(canonical.encode()).hexdigest()
    return json.dumps(own | {"content_sha256": digest}, indent=1).encode()


def small_harmonic_map() -> PretravelMap:
    """Three lobes, with a full covariance and the provenance of a qualification."""
    made = lobes(3)
    half = np.array([[2e-4, 0.0, 0.0], [1e-5, 1e-4, 0.0], [-3e-5, 2e-5, 1e-4]])
    return replace(
        made,
        covariance=Covariance.full(half @ half.T),
        repeatability=3e-4,
        repeatability_dof=50.0,
        provenance=example_map("mean").provenance,
    )


def averaged_example() -> PretravelMap:
    made = small_harmonic_map()
    others = [
        made_up_map(each, support=made.support)
        for each in (MeanBasis(), WozniakBasis(0.2, "piezo"))
    ]
    basis, coefficients, covariance = averaged_map(
        [made, *others], [np.zeros(3)] * 3, [0.5, 0.3, 0.2]
    )
    return replace(made, basis=basis, coefficients=coefficients, covariance=covariance)
