"""Evaluate touches at 0° and 180° of the spindle: means without run-out and odd lobes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import DEGREE, MICROMETRE
from pretravel.task import (
    PAGES,
    SILENT,
    Angles,
    Field,
    OfOneTip,
    Progress,
    Reported,
    Result,
    TouchFilesWithFeed,
    output,
)

if TYPE_CHECKING:
    from pretravel.files import FileReadings
    from pretravel.laboratory.reversal import ReversedPairs
    from pretravel.show import Document, View


class Reversal(TouchFilesWithFeed, OfOneTip, Reported):
    """Average touches at 0° and 180° of the spindle, which cancels run-out and odd lobes.

    The means go to pretravel qualify, compensate or measure like other touches.
    """

    name = "reversal"
    example = "pretravel reversal at_0.csv at_180.csv --spindle 0,180 -o means.csv"

    spindle: Annotated[
        Angles | None,
        Field(
            help="Orientation of the spindle in each file, in degrees: 0,180. Without it, a "
            "column spindle_deg gives it.",
            metavar="ANGLES",
        ),
    ] = None
    output: Annotated[
        Path | None, output("Means: .csv; or a page, .html or .pdf.", ".csv", ".parquet", *PAGES)
    ] = None

    def run(self, progress: Progress = SILENT) -> ReversedTouches:
        """Read the touches and pair them."""
        from pretravel.laboratory.reversal import reversed_touches

        turns = None if self.spindle is None else [a * DEGREE for a in self.spindle.degrees]
        readings = self.read_touches(progress, spindle=turns).in_machine_axes()
        return ReversedTouches(self, readings, reversed_touches(readings.touches))


_NOT_TURNED = (
    "the touches at both orientations agree within their noise: there is neither an offset of the "
    "tip nor an odd lobe. Was the spindle turned by 180° between them? If not, the means still "
    "contain both"
)


@dataclass(frozen=True, eq=False)
class ReversedTouches(Result):
    """Means of touches at two orientations, and what they are rid of."""

    task: Reversal
    readings: FileReadings
    evaluated: ReversedPairs

    def document(self) -> Document:
        """The report."""
        from pretravel.laboratory.reversal import ORDERS
        from pretravel.show import Digits, Document, KeyFigure, Picture, decimals

        found, two = self.evaluated, Digits(2, significant=True)
        known = math.isfinite(found.noise)
        figures = [
            KeyFigure("removed", found.removed / MICROMETRE, "µm", decimals(2),
                      remark="root mean square: offset of the tip, odd lobes, noise of a mean")
        ]  # fmt: skip
        if known:
            k = found.factor
            u = float(found.u[0]) / MICROMETRE
            across = 2.0 * math.hypot(*found.runout.tolist()) / MICROMETRE
            figures += [
                KeyFigure("noise of a touch", found.noise / MICROMETRE, "µm", decimals(2),
                          remark=f"of a mean {found.u_mean / MICROMETRE:.2f} µm"),
                KeyFigure("tip offset", tuple((found.runout / MICROMETRE).tolist()), "µm",
                          decimals(2), u=(u, u), u_digits=two, coverage_factor=k,
                          remark="from the axis of the spindle, along x and y with the spindle at "
                          "0°, any lobe of order one of the probe included; the run-out is "
                          f"twice this offset, {across:.2f} µm"),
                *(
                    KeyFigure(f"lobes of order {order}", size / MICROMETRE, "µm", decimals(2),
                              u=own / MICROMETRE, u_digits=two, coverage_factor=k,
                              remark=_together(others))
                    for order, size, own, others in zip(
                        ORDERS, found.amplitudes.tolist(), found.u.tolist(), found.together,
                        strict=True,
                    )
                    if order > 1 and math.isfinite(size)
                ),
            ]  # fmt: skip
        else:
            figures.append(
                KeyFigure("noise and lobes", "not determined: fewer than 8 directions around")
            )
        return Document(
            title=f"{self.task.touches_name}: touches at two orientations of the spindle",
            verdict=f"{len(found.means)} means of two orientations: without run-out and odd lobes",
            figures=tuple(figures),
            pictures=(
                Picture(
                    "Half of the difference of both orientations, over the azimuth",
                    lambda: _view(found),
                ),
            ),
            notes=(
                (
                    "the means still contain the mean pretravel, lobes of even order, and errors "
                    "that do not turn with the spindle. A qualification on the means of a ring or "
                    "a sphere determines them with U"
                ),
            ),
            warnings=(*self.readings.notes(), *((_NOT_TURNED,) if found.shows_nothing else ())),
        )

    def write(self, output: str, path: Path) -> None:
        """Write the means as touches."""
        del output
        from pretravel.files import write_touches

        write_touches(path, self.evaluated.means)


def _together(orders: Sequence[int]) -> str:
    """What else a lobe contains, in words."""
    if not orders:
        return "amplitude"
    named = ", ".join(str(order) for order in orders[:3])
    return (
        f"amplitude; not distinguished from order {named}, of which u contains the usual size; an "
        "odd number of equal steps separates more"
    )


def _view(found: ReversedPairs) -> View:
    from pretravel.base import azimuth_angle
    from pretravel.show import Axis, Dots, PlaneChart, Rule, View, azimuth_axis

    azimuth = azimuth_angle(found.means.normals) / DEGREE
    dots = Dots(azimuth, found.half_differences / MICROMETRE, "half of the difference", "series1")
    chart = PlaneChart("Removed by averaging both orientations", azimuth_axis(),
                       Axis("half of the difference", "µm"), (Rule(0.0), dots))  # fmt: skip
    return View("Touches at two orientations of the spindle", (chart,))
