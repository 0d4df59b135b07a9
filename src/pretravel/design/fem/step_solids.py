"""The solids of a STEP file that take the place of the described ones."""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import DescriptionError, InputError
from pretravel.design.fem.regions import TIP, ProbeSolid
from pretravel.prediction import Material, Probe, StepGeometry
from pretravel.surface import read_step_solids


def step_solids(probe: Probe, step: StepGeometry) -> list[ProbeSolid]:
    """The chosen solids of a STEP file, each with its material.

    Raises
    ------
    InputError
        A file that cannot be read, or that does not contain a chosen solid.
    DescriptionError
        Solids chosen twice; a tip of another size or at another place than described.
    """
    path = Path(step.path)
    if not path.is_file():
        raise InputError(
            "no such file; [geometry] step is a path relative to the description", path=path
        )
    solids = read_step_solids(path)
    listing = "; ".join(
        f"#{number} '{solid.name or ''}' {solid.mass:.0f} mm³"
        for number, solid in enumerate(solids, start=1)
    )
    counted = Counter(solid.name for solid in solids)

    def picked(selector: str) -> list[Any]:
        """One solid by its number, or all solids of a name (such as three rods)."""
        if re.fullmatch("#[0-9]{1,9}", selector):
            number = int(selector[1:])
            if 1 <= number <= len(solids):
                return [solids[number - 1]]
        elif counted[selector]:
            return [solid for solid in solids if solid.name == selector]
        raise InputError(f"there is no solid '{selector}'; there are {listing}", path=path)

    chosen = [*step.tripod, *step.stylus, *step.tip]
    twice = [name for name, count in Counter(chosen).items() if count > 1]
    if twice:
        raise DescriptionError(f"[geometry]: solid '{twice[0]}' is named for two parts")
    unknown = [name for name in step.materials if name not in chosen]
    if unknown:
        raise DescriptionError(
            f"[geometry] materials: '{unknown[0]}' is not one of the chosen solids, "
            f"{', '.join(chosen)}"
        )
    if len(step.tip) != 1 or len(picked(step.tip[0])) != 1:
        raise DescriptionError("[geometry] tip: the tip is one solid")
    usual = {
        "tripod": [probe.tripod.material] * len(step.tripod),
        "stylus": _stylus_materials(probe, step),
        TIP: [probe.tip.material],
    }
    parts = []
    for role, selectors in (("tripod", step.tripod), ("stylus", step.stylus), (TIP, step.tip)):
        for selector, material in zip(selectors, usual[role], strict=True):
            name = TIP if role == TIP else f"{role}: {selector}"
            parts += [
                ProbeSolid(name, solid, step.materials.get(selector, material), role == "tripod")
                for solid in picked(selector)
            ]
    _check_tip(probe, parts[-1].solid, path)
    return parts


def _stylus_materials(probe: Probe, step: StepGeometry) -> list[Material]:
    """The described segments' materials in order; if the numbers differ, their one material."""
    described = [segment.material for segment in probe.stylus]
    if len(step.stylus) == len(described):
        return described
    missing = [selector for selector in step.stylus if selector not in step.materials]
    if missing and len(set(described)) > 1:
        raise DescriptionError(
            f"[geometry]: the stylus has {len(step.stylus)} solids and [[stylus]] {len(described)} "
            f"segments of several materials; give the material of '{missing[0]}': "
            f'materials = {{ "{missing[0]}" = "ceramic" }}'
        )
    return [described[0]] * len(step.stylus)


def _check_tip(probe: Probe, solid: Any, path: Path) -> None:
    """Check that the tip of a STEP file has the described place and size."""
    low, high = solid.bounding_box
    centre = np.array([0.5 * (low[i] + high[i]) for i in range(3)])
    radius = 0.5 * max(high[i] - low[i] for i in range(3))
    for factor, unit in ((25.4, "inch"), (10.0, "cm"), (1000.0, "m")):
        if abs(radius * factor / probe.tip.radius - 1.0) < 0.02:
            raise DescriptionError(
                f"{path}: the tip has a radius of {radius:.4g} mm, {factor:g} times less than the "
                f"{probe.tip.radius:g} mm described: are its numbers in {unit}? Export it in mm"
            )
    if abs(radius - probe.tip.radius) > 0.01 * probe.tip.radius:
        raise DescriptionError(
            f"{path}: the tip has a radius of {radius:.4g} mm, but [tip] gives "
            f"{probe.tip.radius:g} mm, which is used to compensate points: correct one of them"
        )
    away = math.dist(centre, (0.0, 0.0, -probe.lever))
    if away > 0.05 * probe.tip.radius:
        raise DescriptionError(
            f"{path}: the tip's centre lies at ({centre[0]:.3f}, {centre[1]:.3f}, "
            f"{centre[2]:.3f}) mm, but (0, 0, {-probe.lever:g}) is described: move "
            "the solids into the probe's frame (origin on the axis in the plane of the rods, z "
            "upwards) or correct stylus lengths and hub offset"
        )
