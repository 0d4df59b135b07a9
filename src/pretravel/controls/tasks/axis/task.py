"""Place and direction of a rotary axis from touches of a sphere at several angles."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import DEGREE, MICROMETRE, REFERENCE_DIAMETER, PretravelError
from pretravel.task import (
    ANSWER,
    PAGES,
    SILENT,
    Angles,
    Field,
    Progress,
    Reported,
    Result,
    TouchFilesWithFeed,
    Vector,
    files_meant,
    output,
)

if TYPE_CHECKING:
    import numpy as np

    from pretravel.controls.rotary_axes import RotaryAxis
    from pretravel.maps import PretravelMap
    from pretravel.show import Document, View
    from pretravel.touches import Touches
    from pretravel.uncertainty import Covariance

_AT = re.compile(r"at(-?\d+(?:\.\d+)?)_")
"""Beginning of a label that states the angle, in degrees."""


class FindAxis(TouchFilesWithFeed, Reported):
    """Determine a rotary axis, from touches of a sphere at several of its angles.

    Give one file for each angle, in the order of --angles, or one file whose labels begin with the
    angle (at60_s1). The positions in the files are those of the machine's axes.
    """

    name = "axis"
    example = (
        "pretravel axis c0.csv c60.csv c120.csv --angles 0,60,120 --axis C --map map.json "
        "-o axis.csv"
    )

    axis: Annotated[
        Literal["A", "B", "C"], Field(help="Rotary axis: A lies along x, B along y, C along z.")
    ]
    angles: Annotated[
        Angles | None,
        Field(
            help="Angle of the axis in each file, in degrees: three or more.",
            metavar="ANGLES",
        ),
    ] = None
    map_file: Annotated[
        Path | None,
        Field(
            help="Map of the probe. Without a map, the pretravel shifts the centres of the sphere "
            "and so the axis, and the uncertainty does not contain this.",
            option="--map",
            reads=True,
        ),
    ] = None
    diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the sphere, in mm: for files that do not give the directions.",
            range=REFERENCE_DIAMETER,
        ),
    ] = None
    work: Annotated[
        Vector,
        Field(
            help="Work offset: origin of the positions in machine coordinates, in mm.",
            metavar="X,Y,Z",
        ),
    ] = Vector(0, 0, 0)
    check: Annotated[
        tuple[Path, ...],
        Field(
            help="Files with touches of the sphere at another distance from the axis, at the same "
            "angles: both must give the same axis.",
            reads=files_meant,
        ),
    ] = ()
    output: Annotated[
        Path | None,
        output(
            "Values: .csv; pins for LinuxCNC's xyzac-trt or xyzbc-trt: .hal; or a page, .html or "
            ".pdf.", ".csv", ".hal", *PAGES,
        ),
    ] = None  # fmt: skip

    def run(self, progress: Progress = SILENT) -> FoundAxis:
        """Read the touches of each angle, compensate them, and fit the axis.

        Raises
        ------
        PretravelError
            Angles that do not belong to the files; as `rotary_axis`.
        """
        import numpy as np

        from pretravel.files import read_map

        pretravel_map = None if self.map_file is None else read_map(self.map_file)
        found, said, notes = self._axis(self.files, pretravel_map, progress)
        again = None
        if self.check:
            again, *more = self._axis(files_meant(self.check), pretravel_map, progress)
            said, notes = [*said, *more[0], *_same_place(found, again)], notes + more[1]
        said, notes = ([*dict.fromkeys(each)] for each in (said, notes))
        answer = FoundAxis(self, found, again, tuple(said), tuple(notes))
        return replace(answer, exit_code=ANSWER) if np.any(answer.ratios >= 1.0) else answer

    def _axis(
        self, files: list[Path], pretravel_map: PretravelMap | None, progress: Progress
    ) -> tuple[RotaryAxis, list[str], list[str]]:
        """The axis, and what readers and map say of the touches: warnings, notes."""
        import numpy as np

        from pretravel.controls.rotary_axes import rotary_axis

        sets, turns, said = self._sets(files, pretravel_map, progress)
        points, common, u_point = _points(sets, pretravel_map)
        warned, notes = _said_of_map(sets, pretravel_map)
        shifted = [own + np.array(self.work) for own in points]
        found = rotary_axis(shifted, turns, self.axis, common)
        self._refuse_other_sphere(found, pretravel_map)
        return found, [*said, *warned, *_scatter_warnings(found, u_point)], notes

    def _refuse_other_sphere(self, found: RotaryAxis, pretravel_map: PretravelMap | None) -> None:
        """Refuse a diameter that is not of the touched sphere; without a map the tip is in it."""
        from pretravel.maps import same_tip

        if self.diameter is None:
            return
        measured = 2.0 * found.radius
        tip = pretravel_map is None
        larger = tip and measured > self.diameter
        if not (larger or same_tip(measured, self.diameter)):  # as tips, by pretravel and tolerance
            raise PretravelError(
                f"the sphere has a diameter of {self.diameter:g} mm, and the touches lie on one of "
                f"{measured:.3f} mm{' with the tip' if tip else ''}: one of them is wrong",
                inputs=("diameter",) if tip else ("diameter", "map_file"),
            )

    def _sets(
        self, files: list[Path], pretravel_map: PretravelMap | None, progress: Progress
    ) -> tuple[list[Touches], list[float], list[str]]:
        """Touches of each angle, the angles [rad], and what the reader says."""
        tip = None if pretravel_map is None else 2.0 * pretravel_map.tip_radius
        sets: list[Touches] = []
        frames, said = list[str](), list[str]()
        for path in files:
            one = replace(self, touches=(path,), exclude=self._excluded_of(path))
            read = one.read_touches(progress, tip_diameter=tip, reference_diameter=self.diameter)
            sets.append(read.in_machine_axes().touches)
            frames.append(read.frame)
            said += read.notes()
            sets[-1].refuse_several()
        _refuse_turned_spindle(sets)
        if len(sets) == 1 and self.angles is None:
            own, turns = _by_label(sets[0], files[0])
            for turn in turns:
                self._refuse_other_angle(files[0], frames[0], (), turn / DEGREE)
            return own, turns, said
        given = () if self.angles is None else self.angles.degrees
        if len(given) != len(sets):
            raise PretravelError(
                f"{len(sets)} files and {len(given)} angles: one angle is needed for each file, in "
                "their order",
                inputs=("angles", "touches"),
            )
        for path, frame, labelled, angle in zip(files, frames, sets, given, strict=True):
            self._refuse_other_angle(path, frame, labelled.labels or (), angle)
        return sets, [angle * DEGREE for angle in given], said

    def _excluded_of(self, path: Path) -> tuple[str, ...]:
        """What is excluded of one file: without the lines of the others."""
        others = {file.name for file in (*self.files, *files_meant(self.check))} - {path.name}
        return tuple(word for word in self.exclude if word.rpartition(":")[0] not in others)

    def _refuse_other_angle(
        self, path: Path, frame: str, labels: tuple[str, ...], angle: float
    ) -> None:
        """Refuse an angle where a column or a label gives the axis another one. [°]"""
        own = rf"(?:^|, ){self.axis}(?![a-z])[^,]* (-?[\d.]+)(?=,|$)"
        found = re.search(own, frame, re.IGNORECASE)
        stated = [] if found is None else [(frame, float(found[1]))]
        of_labels = [(f"the label {label}", _AT.match(label)) for label in labels]
        stated += [(where, float(at[1])) for where, at in of_labels if at is not None]
        for where, degrees in stated:
            apart = (degrees - angle + 180.0) % 360.0 - 180.0
            if abs(apart) > _SAME_ANGLE:
                raise PretravelError(
                    f"{path}: the file gives {where}, and the angle {angle:g}° is given for it: "
                    "one of them is wrong",
                    inputs=("angles",),
                )


_SAME_ANGLE = 0.1
"""Of an angle as it was asked for and as a control shows it. [°]"""
_SAME_PLACE = 0.5
"""Up to this difference, distances from the axis, or places along it, are one. [mm]"""
_SCATTERS_MORE = 3.0
"""Times u of the points: noise from which something is wrong."""
_WANDERS = 0.02
"""Wander that only bad axes have. [mm]"""


def _refuse_turned_spindle(sets: list[Touches]) -> None:
    """Refuse touches at several orientations of the spindle: the tip runs out, and centres move."""
    from pretravel.maps import SAME_ORIENTATION, orientation_of

    stated = [angle for own in sets if (angle := orientation_of(own)) is not None]
    turns = [abs((angle - stated[0] + 180.0) % 360.0 - 180.0) for angle in stated]
    other = [angle for angle, turn in zip(stated, turns, strict=True) if turn > SAME_ORIENTATION]
    if other:
        raise PretravelError(
            f"the spindle is at {stated[0]:g}° in some of these touches and at {other[0]:g}° in "
            "others: the run-out of the tip and the lobes of the probe turn with it, and move the "
            "centres of the sphere. Touch at one orientation of the spindle",
            inputs=("touches",),
        )


def _same_place(found: RotaryAxis, again: RotaryAxis) -> list[str]:
    """A warning about a check where the sphere is at the same place.

    Raises
    ------
    PretravelError
        The check has the same touches.
    """
    import numpy as np

    problem = "they agree whatever the axis is. Move the sphere to another radius"
    if found.centers.shape == again.centers.shape and np.all(found.centers == again.centers):
        raise PretravelError(f"the check has the same touches: {problem}", inputs=("check",))
    along = "ABC".index(found.letter)
    place = [np.array([one.distance, one.point[along]]) for one in (found, again)]
    if np.any(np.abs(place[1] - place[0]) > _SAME_PLACE):
        return []
    where = f"at the same distance from the axis, {found.distance:.2f} mm"
    return [f"the touches of the check are {where}: {problem}"]


def _said_of_map(
    sets: list[Touches], pretravel_map: PretravelMap | None
) -> tuple[list[str], list[str]]:
    """What touches and map state that does not fit, of feed, orientation and tip; and notes."""
    from pretravel.measurement import TouchSummary

    if pretravel_map is None:
        return [], []
    said, notes = list[str](), list[str]()
    for own in sets:
        summary = TouchSummary.of_conditions(own, pretravel_map)
        said += summary.conditions(pretravel_map)
        notes += summary.notes(pretravel_map)
    if not pretravel_map.states_uncertainty:
        said.append(
            "this map is a prediction without an uncertainty: u does not contain the difference "
            "between the described probe and yours"
        )
    if not _center_stated(pretravel_map):
        said.append(
            "the map does not give the uncertainty of its centre (an earlier version made it). "
            "The place of the axis contains the part of the pretravel that a sphere does not "
            "show, most along the probe axis; the uncertainty does not. Qualify again"
        )
    return said, notes


def _scatter_warnings(found: RotaryAxis, u_point: float | None) -> list[str]:
    """What noise and wander say, that u contains but that may be a mistake."""
    said = []
    if u_point is not None and found.noise > max(_SCATTERS_MORE * u_point, MICROMETRE):
        said.append(
            f"the touches scatter by {found.noise / MICROMETRE:.2g} µm about their spheres, and u "
            f"of a point is {u_point / MICROMETRE:.2g} µm: a gross error, another probe than that "
            "of the map, or another orientation"
        )
    if found.wander > _WANDERS:
        said.append(
            f"the centres are {found.wander / MICROMETRE:.2g} µm off their circle: was the sphere "
            "moved, and are the angles those of the touches?"
        )
    return said


def _by_label(touches: Touches, path: Path) -> tuple[list[Touches], list[float]]:
    rows: dict[float, list[int]] = {}
    for row, label in enumerate(touches.labels or [""] * len(touches)):
        stated = _AT.match(label)
        if stated is None:
            raise PretravelError(
                f"{path}: the label '{label}' of touch {row + 1} has no angle (at60_s1); give "
                "the angles, and a file for each",
                inputs=("angles",),
            )
        rows.setdefault(float(stated[1]), []).append(row)
    return [touches.take(own) for own in rows.values()], [a * DEGREE for a in rows]


def _points(
    sets: list[Touches], pretravel_map: PretravelMap | None
) -> tuple[list[np.ndarray], list[Covariance], float | None]:
    """Surface points of each angle, what they have in common, and u of a point; tip centres
    without a map.

    The normals are those of the sphere on which the tip's centres lie. Stated normals are those
    of the planned sphere: 0.5 mm next to it they compensate a tip of 6 mm wrong by 2 µm.
    """
    import numpy as np

    from pretravel.maps import refuse_other_orientation
    from pretravel.measurement import REPEATABILITY, apply, point_sources
    from pretravel.touches import Touches
    from pretravel.uncertainty import Covariance

    if pretravel_map is None:
        return [own.positions for own in sets], [], None
    for own in sets:
        refuse_other_orientation(own, pretravel_map)
    feeds = [own.feeds for own in sets if own.feeds is not None]
    every = Touches(
        positions=np.vstack([own.positions for own in sets]),
        normals=np.vstack([_outward(own.positions) for own in sets]),
        approaches=np.vstack([own.approach_directions for own in sets]),
        feeds=np.concatenate(feeds) if len(feeds) == len(sets) else None,
    )
    points = apply(every, pretravel_map)
    ends = np.cumsum([len(own) for own in sets])[:-1]
    sources = point_sources(every, points, pretravel_map)
    common = [along for name, along in sources.items() if name != REPEATABILITY]
    of_center = pretravel_map.provenance.center_covariance
    if of_center is not None:
        # A shift of a centre and a map with one lobe are the same: a place has it, points do not.
        along = points.normals @ pretravel_map.rotation
        common.append(Covariance.full(along @ np.array(of_center) @ along.T))
    u_point = float(np.sqrt(np.mean(points.standard_uncertainty**2)))
    return np.split(points.positions, ends), common, u_point


def _center_stated(pretravel_map: PretravelMap) -> bool:
    """Maps that are predicted or calibrated on a rig have an absolute pretravel."""
    from pretravel.maps import Origin

    made = pretravel_map.provenance
    return made.origin is not Origin.QUALIFIED or made.center_covariance is not None


def _outward(positions: np.ndarray) -> np.ndarray:
    """Directions of the tip's centres from the middle of their sphere, (n, 3)."""
    import numpy as np

    from pretravel.uncertainty import fit_sphere

    away = positions - fit_sphere(positions).center
    return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class FoundAxis(Result):
    """A rotary axis, and the same from another radius.

    Attributes
    ----------
    task : FindAxis
    found : RotaryAxis
    again : RotaryAxis or None
    said, notes : tuple of str
        What files and map say of the touches, as sentences; notes are of what is not stated.
    exit_code : int
        `ANSWER` where the two radii contradict each other.
    """

    task: FindAxis
    found: RotaryAxis
    again: RotaryAxis | None
    said: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    exit_code: int = 0

    @property
    def ratios(self) -> np.ndarray:
        """Differences of the two radii by the expanded uncertainty of these, (4,); 1 and more is
        a contradiction. Places are compared at the same height.
        """
        import numpy as np

        if self.again is None:
            return np.zeros(4)
        one, two = self.found, self.again
        along = "ABC".index(one.letter)
        height = two.point[along] - one.point[along]
        place = one.values[:2] + height * one.values[2:]
        difference = np.concatenate([two.values[:2] - place, two.values[2:] - one.values[2:]])
        moved = np.hypot(one.expanded[:2], height * one.expanded[2:])
        u = np.hypot(np.concatenate([moved, one.expanded[2:]]), two.expanded)
        return np.asarray(np.abs(difference) / u)

    def rows(self) -> list[tuple[str, float, float, float]]:
        """Name, value, u and U of each; slopes in mm per m, which are µm per mm."""
        import numpy as np

        found = self.found
        names = ["xyz"[axis] for axis in found.across]
        u = np.sqrt(np.diag(found.covariance))
        return [
            *((f"place_{n}_mm", found.values[i], u[i], found.expanded[i])
              for i, n in enumerate(names)),
            *((f"slope_{n}_mm_per_m", 1e3 * found.values[2 + i], 1e3 * u[2 + i],
               1e3 * found.expanded[2 + i]) for i, n in enumerate(names)),
        ]  # fmt: skip

    def document(self) -> Document:
        """The report."""
        import numpy as np

        from pretravel.show import Digits, Document, KeyFigure, Picture, by_uncertainty, decimals

        found, two = self.found, Digits(2, significant=True)
        along = "ABC".index(found.letter)
        names = ["xyz"[axis] for axis in found.across]
        u = np.sqrt(np.diag(found.covariance))
        figures = [
            KeyFigure(f"{name} of the axis {found.letter}", float(found.values[i]), "mm",
                      by_uncertainty(float(u[i])), u=float(u[i]) / MICROMETRE, u_unit="µm",
                      u_digits=two,
                      coverage_factor=float(found.factors[i]),
                      remark=f"at {'xyz'[along]} = {found.point[along]:.3f} mm")
            for i, name in enumerate(names)
        ] + [
            KeyFigure(f"slope along {name}", float(1e3 * found.values[2 + i]), "mm/m",
                      by_uncertainty(float(1e3 * u[2 + i])),
                      u=float(1e3 * u[2 + i]), u_digits=two,
                      coverage_factor=float(found.factors[2 + i]))
            for i, name in enumerate(names)
        ] + [
            KeyFigure("noise of a touch", found.noise / MICROMETRE, "µm", decimals(2)),
            KeyFigure("wander of the axis", found.wander / MICROMETRE, "µm", decimals(2),
                      remark="of each coordinate of a centre, beyond the noise of the touches"),
            KeyFigure("sense", "with the angle" if found.sense > 0 else "against the angle",
                      remark="right-handed about the machine's axis" if found.sense > 0
                      else "left-handed about the machine's axis, as a rotary table turns"),
        ]  # fmt: skip
        if self.again is not None:
            figures.append(
                KeyFigure("check at another radius", float(self.ratios.max()), "", decimals(2),
                          remark="largest difference by its expanded uncertainty")
            )  # fmt: skip
        against = self.exit_code == ANSWER
        count = len(found.angles)
        return Document(
            title=f"{self.task.touches_name}: rotary axis {found.letter}",
            verdict=f"rotary axis {found.letter} from {count} angles"
            + (", contradicted at another radius" if against else ""),
            figures=tuple(figures),
            pictures=(
                Picture(
                    "Distances of the sphere's centres from their circle", lambda: _view(found)
                ),
            ),
            warnings=self._warnings(),
            notes=self.notes,
        )

    def _warnings(self) -> tuple[str, ...]:
        """What the uncertainty does not contain, and whether two radii agree."""
        found = list(self.said)
        if self.task.map_file is None:
            found.append(
                "no map of the probe is given: its pretravel shifts the centre of each sphere, and "
                "so the place of the axis, most along the probe axis. The uncertainty does not "
                "contain this shift"
            )
        if self.exit_code == ANSWER:
            found.append("the two radii contradict each other: see the ratio")
        return tuple(found)

    def write(self, output: str, path: Path) -> None:
        """Write the values, or lines for the control."""
        del output
        from pretravel.base import write_text
        from pretravel.files import write_csv_table

        if path.suffix.lower() == ".hal":
            write_text(path, self.pins())
            return
        names, values, u, expanded = zip(*self.rows(), strict=True)
        write_csv_table(
            path,
            {"quantity": names, "value": values, "u": u, "expanded_uncertainty": expanded},
        )

    def pins(self) -> str:
        """Lines for a HAL file of LinuxCNC: the places of the axis across itself.

        The pins of xyzac-trt-kins and xyzbc-trt-kins are the point about which both axes turn,
        in the machine: of A its y and z, of B its x and z, of C its x and y. A C axis that does not
        meet the other one has an offset, the difference of their places.
        """
        found = self.found
        kins = {"A": "xyzac-trt-kins", "B": "xyzbc-trt-kins", "C": "xyzac-trt-kins"}[found.letter]
        lines = [
            f"# rotary axis {found.letter}, pretravel axis; U is the expanded uncertainty",
            "# a slope of the axis has no pin",
        ]
        for index, axis in enumerate(found.across):
            lines.append(
                f"setp {kins}.{'xyz'[axis]}-rot-point {found.values[index]:.6f}"
                f"  # U = {found.expanded[index]:.6f}"
            )
        return "\n".join(lines) + "\n"


def _view(found: RotaryAxis) -> View:
    from pretravel.show import SERIES, Axis, Dots, PlaneChart, Rule, View, number_text

    angle = found.angles / DEGREE
    dots = tuple(
        Dots(angle, found.residuals[:, axis] / MICROMETRE, "xyz"[axis], colour)
        for axis, colour in enumerate(SERIES[:3])
    )
    chart = PlaneChart(
        f"axis {found.letter}, wander {number_text(found.wander / MICROMETRE)} µm",
        Axis(f"angle of {found.letter}", "°"),
        Axis("distance from the circle", "µm"),
        (Rule(0.0), *dots),
    )
    return View("Distances of the sphere's centres from their circle", (chart,))
