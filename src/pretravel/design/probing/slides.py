"""One touch step by step, as in the thesis: the spindle moves on, the tip slides on the surface.

`pretravel.design.probing.touching` finds the same trigger without steps; here the way to it is
recorded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import COUNT, STEP, PretravelError, check_numbers, checked
from pretravel.design.probing.slide_curved import FirstContact, slide_with_model, slide_with_rays
from pretravel.design.probing.slide_history import SlideHistory
from pretravel.design.probing.slide_one_normal import golden_section_slide, stepped_slide
from pretravel.design.probing.tip import LateralTip, OpeningTip, PredictedTip, tip_of
from pretravel.prediction import Probe
from pretravel.surface import Surface, face_of

PROCESSES = ("curved", "inclined", "vertical")
"""Sections 3.4, 3.3 and 3.2 of the thesis."""
SEARCHES = ("steps", "golden")
KINEMATICS = ("lateral", "full")

_WALL = 0.01
"""Largest cosine between a wall's normal and the probe axis."""


@dataclass(frozen=True)
class SlideSettings:
    """How a slide is stepped.

    Parameters
    ----------
    step : float, optional
        For the process ``curved`` the feed of each step, for ``vertical`` the deflection, 1 µm
        when not given [mm]; for ``inclined`` the force, 0.1 N when not given [N].
    steps : int
        Number of steps; in a golden section search the largest number of trials.
    process : str
        ``curved``: sub-processes, in each of which the force keeps the direction of the
        normal before; a ray, tangency, and force against deflection. ``vertical``:
        the deflection is raised until the probe triggers. ``inclined``: the force is raised.
    search : str
        ``steps``; or ``golden``: golden section search between zero and 5 N (``inclined``) or
        between zero and step times steps (``vertical``).
    kinematics : str
        For ``curved``: ``lateral``, as in the thesis, where the stylus deflects only
        perpendicular to its axis and nothing is compressed; ``full``, with all displacements of
        the model.

    Raises
    ------
    PretravelError
        Unknown words, a step that is not positive, or settings that contradict each other.

    >>> SlideSettings(process="inclined").step_size
    0.1
    """

    step: float | None = None
    steps: int = 20
    process: str = "curved"
    search: str = "steps"
    kinematics: str = "lateral"

    def __post_init__(self) -> None:
        for name, value, known in (
            ("process", self.process, PROCESSES),
            ("search", self.search, SEARCHES),
            ("kinematics", self.kinematics, KINEMATICS),
        ):
            if value not in known:
                raise PretravelError(f"{name} '{value}' is unknown; there are {', '.join(known)}")
        checked(self.step_size, "the step", STEP, inputs=("step",))
        check_numbers(self, steps=COUNT)
        if not 1 <= self.steps <= 100_000:
            raise PretravelError(f"{self.steps} steps; the number must be from 1 to 100000")
        if self.kinematics == "full" and self.process != "curved":
            raise PretravelError(
                f"the process {self.process} is that of the thesis, where the stylus deflects only "
                "perpendicular to its axis; full kinematics are for the process curved, which "
                "works on any surface",
                inputs=("kinematics", "process"),
            )
        if self.search == "golden" and self.process == "curved":
            raise PretravelError(
                "the golden section search is for vertical and inclined surfaces; on curved "
                "surfaces the force changes its direction from step to step",
                inputs=("search",),
            )

    @property
    def step_size(self) -> float:
        """The step, given or not. [mm or N]"""
        if self.step is None:
            return 0.1 if self.process == "inclined" else 0.001
        return self.step


def slide(
    tip: PredictedTip | Probe | str,
    surface: Surface | str,
    at: tuple[float, float],
    settings: SlideSettings | None = None,
) -> SlideHistory:
    """Probe one point of a surface along its normal, step by step.

    Parameters
    ----------
    tip : PredictedTip, Probe or str
        A description (or its name in the catalogue) is used with the model ``analytic``.
    surface : Surface or str
        Machine frame; a face of a part, or a specification as on the command line.
    at : pair of float
        Parameters u, v of the first contact.
    settings : SlideSettings, optional
        Twenty steps of 1 µm with the process ``curved`` when not given.

    Returns
    -------
    SlideHistory

    Raises
    ------
    PretravelError
        A point outside the surface; a normal along the probe axis, where a stylus that deflects
        only sideways cannot deflect; the process ``vertical`` on a surface that is not a wall.

    References
    ----------
    Rodrigues 2021, sections 3.2 to 3.4 and 4.2; Tables 4.10 and 4.11.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.design.probing.tip import predicted_tip
    >>> from pretravel.surface.parametric import Convex
    >>> tip = predicted_tip(load_probe("omp40-2"))
    >>> slide(tip, Convex(), (0.5, 0.5), SlideSettings(steps=2)).deflection.round(6).tolist()
    [0.003608, 0.007214]
    """
    settings = settings or SlideSettings()
    described = tip_of(tip)
    if isinstance(described, OpeningTip):
        raise PretravelError(
            "a slide ends at the force of the trigger, and does not contain the opening of the "
            "contact after it: set opening_um of [trigger] to 0, or use predict or simulate"
        )
    if not isinstance(described, PredictedTip):
        raise PretravelError("a slide needs a described probe: a map contains no forces")
    first = _first_contact(face_of(surface), at)
    _check_direction(LateralTip(described), first, settings)
    if settings.process == "curved":
        if settings.kinematics == "full":
            return slide_with_model(described, first, settings.step_size, settings.steps)
        return slide_with_rays(LateralTip(described), first, settings.step_size, settings.steps)
    along = golden_section_slide if settings.search == "golden" else stepped_slide
    by_force = settings.process == "inclined"
    return along(described, first.local, settings.step_size, settings.steps, by_force=by_force)


def _first_contact(surface: Surface, at: tuple[float, float]) -> FirstContact:
    uv = np.array([at], dtype=np.float64)
    if not surface.inside(uv)[0]:
        low, high = surface.domain.lower, surface.domain.upper
        raise PretravelError(
            f"u, v = {at[0]:g}, {at[1]:g} is not on the surface: u goes from {low[0]:g} to "
            f"{high[0]:g}, v from {low[1]:g} to {high[1]:g}, within the edges of the face"
        )
    local = surface.local(uv)
    if not np.all(np.isfinite(local.normal)):
        raise PretravelError(f"the surface has no normal at u, v = {at[0]:g}, {at[1]:g}")
    return FirstContact(surface, uv, local)


def _check_direction(tip: LateralTip, first: FirstContact, settings: SlideSettings) -> None:
    normal = first.local.normal
    if settings.kinematics == "lateral" and not np.any(tip.across(normal)):
        raise PretravelError(
            f"at u, v = {first.uv[0, 0]:g}, {first.uv[0, 1]:g} the surface is perpendicular to the "
            "probe axis: a stylus that deflects only sideways cannot deflect there; full "
            "kinematics let it move along the axis",
            inputs=("kinematics",),
        )
    upright = abs(float(normal[0] @ tip.axis))
    if settings.process == "vertical" and upright > _WALL:
        polar = math.degrees(math.acos(upright))
        raise PretravelError(
            f"the process vertical is for walls; here the normal is {polar:.1f}° from the probe "
            "axis: choose inclined or curved",
            inputs=("process",),
        )
