"""Make probing programs for LinuxCNC, and subroutines to call by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeAlias

from pretravel.base import ANGLE, DEGREE, FEED, PretravelError
from pretravel.controls.tasks.fields import StylusOfSubroutines, ToolOfSubroutines, refuse_no_folder
from pretravel.task import (
    FOLDER,
    PROGRAMS,
    SILENT,
    Angles,
    Approach,
    Field,
    PolarAngles,
    Progress,
    Result,
    SphereDiameter,
    Task,
    Turn,
    Vector,
    When,
    is_shape,
    output,
    surface_files,
    typed_numbers,
)

if TYPE_CHECKING:
    from pretravel.base import FloatArray
    from pretravel.controls.program import ProbingProgram
    from pretravel.files import Machine
    from pretravel.maps import PretravelMap
    from pretravel.surface import Part

_RINGS = "0,20,40,60,75,90"
_TOUCHES_ON_THE_EQUATOR = 24
_RINGS_OF_AXIS = "0,40,80"
_TOUCHES_AT_AN_ANGLE = 8
_RINGS_PATTERN = When("pattern", ("rings",))
_NAMED = 20
"""Targets that are left out and named."""


def _patterns() -> list[str]:
    from pretravel.task import patterns

    return ["rings", *patterns()]


MachinePath: TypeAlias = Annotated[
    Path,
    Field(
        help="Machine file: pretravel machine > mill.toml writes one to edit.",
        positional=True,
        reads=True,
    ),
]


class Feeds(tuple[float, ...]):
    """Feeds. [mm/min]"""

    def __str__(self) -> str:
        return ",".join(f"{feed:.12g}" for feed in self)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Feeds from ``a,b,…``, in mm/min.

        >>> Feeds.parse("50,200")
        (50.0, 200.0)
        """
        expected = "feeds in mm/min, for example 50,200"
        return cls(typed_numbers(text, text.count(",") + 1, expected, FEED))


class ProgramTask(Task):
    """Settings of tasks that make a program."""

    output: Annotated[Path, output("Program: .ngc.", *PROGRAMS)]
    repeats: Annotated[
        int, Field(help="Repeats of each touch, one after the other.", range=(1, 1000))
    ] = 1
    feeds: Annotated[
        Feeds | None,
        Field(
            help="Measuring feeds a,b,…, in mm/min: every touch is made once at each feed; the "
            "default is the feed of the machine file.",
            metavar="FEEDS",
        ),
    ] = None
    log: Annotated[
        str | None,
        Field(
            help="Log file on the machine, next to its INI file: NAME_log.ngc, which the control "
            "can read again; the default NAME is that of the program."
        ),
    ] = None

    spindle_deg: Annotated[
        float | None,
        Field(
            help="Orientation of the spindle during the touches, in degrees: the program orients "
            "the spindle (M19) and writes the angle to the log. For pretravel reversal make one "
            "program for 0 and one for 180.",
            range=ANGLE,
            label="Orientation of the spindle",
        ),
    ] = None
    by_hand: Annotated[
        bool,
        Field(
            help="For a machine without M19: the program stops at the safe height, where you turn "
            "the spindle by hand.",
            only=("spindle_deg",),
        ),
    ] = False

    @property
    def log_name(self) -> str:
        """Of the log file on the machine."""
        from pretravel.controls.program_log import LOG_ENDING

        return self.log or f"{self.output.stem.lower()}{LOG_ENDING}"


def _rings(polar: PolarAngles | None = None, count: int | None = None) -> FloatArray:
    """Directions of rings, the usual ones where nothing is given."""
    from pretravel.base import ring_pattern

    rings = PolarAngles.parse(_RINGS) if polar is None else polar
    on_equator = _TOUCHES_ON_THE_EQUATOR if count is None else count
    return ring_pattern([angle * DEGREE for angle in rings.degrees], on_equator)


def _pattern_help() -> str:
    """The patterns, each with the number of its touches."""
    from pretravel.task import patterns

    iso10360, iso230 = (len(patterns()[name]()) for name in ("iso10360-5", "iso230-10"))
    return (
        f"rings (at polar 0 to 90°, {len(_rings())} touches), iso10360-5 ({iso10360}) or iso230-10 "
        f"({iso230} on the equator)."
    )


class ProgramSphere(ProgramTask):
    """Touch a reference sphere in all directions, for pretravel qualify.

    Set the origin of the work offset to the centre of the sphere (or give --center), within 1 mm.
    """

    name = "program sphere"
    example = "pretravel program sphere mill.toml --diameter 24.9987 -o sphere.ngc"

    machine: MachinePath
    diameter: SphereDiameter
    pattern: Annotated[
        str,
        Field(
            help=_pattern_help,
            names=_patterns,
            metavar="PATTERN",
        ),
    ] = "rings"
    polar: Annotated[
        PolarAngles | None,
        Field(
            help="Polar angles of the rings, in degrees; 90 is the equator; the default is "
            f"{_RINGS}.",
            metavar="ANGLES",
            only=(_RINGS_PATTERN,),
        ),
    ] = None
    count: Annotated[
        int | None,
        Field(
            help="Touches on the equator; other rings are as dense; the default is "
            f"{_TOUCHES_ON_THE_EQUATOR}.",
            range=(1, 10_000),
            only=(_RINGS_PATTERN,),
        ),
    ] = None
    center: Annotated[
        Vector,
        Field(
            help="Centre of the sphere in work coordinates, in mm.",
            label="Centre of the sphere",
            metavar="X,Y,Z",
        ),
    ] = Vector(0, 0, 0)
    shank: Annotated[
        float,
        Field(
            help="Diameter of a vertical shank below the sphere, in mm; 0: none.",
            range=(0.0, 1000.0),
            unit="mm",
        ),
    ] = 0.0
    turn_deg: Turn = 0.0
    repeats: Annotated[
        int,
        Field(
            help="Passes over all directions, each in another order. Repeats one after the other "
            "would not show a drift: it would look like a part of the map.",
            range=(1, 1000),
        ),
    ] = 1

    def run(self, progress: Progress = SILENT) -> PlannedProgram:
        """Plan the touches and the moves between them.

        Raises
        ------
        PretravelError
            A shank as thick as the sphere; rings of another pattern; as `plan_program`.
        """
        import numpy as np

        from pretravel.base import probe_rotation
        from pretravel.controls.program import plan_program
        from pretravel.controls.surroundings import SphereObstacle
        from pretravel.files import read_machine
        from pretravel.touches import Targets

        _check_shank(self.shank, self.diameter)
        known = read_machine(self.machine)
        _check_tip(known, self.diameter)
        normals = self._directions() @ probe_rotation(rotation=self.turn_deg * DEGREE).T
        middle, radius = np.array(self.center), 0.5 * self.diameter
        rows, labels = _in_passes(len(normals), self.repeats)
        normals = normals[rows]
        x, y, z = self.center
        with progress.working("planning"):
            program = plan_program(
                Targets(middle + radius * normals, normals, labels=labels),
                known,
                title=f"sphere of {self.diameter:g} mm around X{x:g} Y{y:g} Z{z:g}",
                feeds=self.feeds or (),
                obstacles=[SphereObstacle(middle, radius, self.shank)],
            )
        return _planned(self, program)

    def _directions(self) -> FloatArray:
        """Directions of the pattern; polar angles and count are those of rings."""
        from pretravel.task import patterns

        if self.pattern == "rings":
            return _rings(self.polar, self.count)
        return patterns()[self.pattern]()


class ProgramAxis(ProgramTask):
    """Touch a reference sphere at several angles of a rotary axis, for pretravel axis.

    Give the centre of the sphere at the first angle and a point on the axis. At each angle the
    sphere must be within clearance_mm (machine file) of its computed place; an error of the point
    on the axis shifts this place by up to twice the error. The axis turns while the tip is at the
    safe height. The same directions are touched at each angle; labels of the log begin with
    the angle. Switch off tool centre point control, which moves X, Y and Z with the axis: M429 in
    LinuxCNC's sample configuration xyzac-trt.
    """

    name = "program axis"
    example = (
        "pretravel program axis mill.toml --axis C --angles 0:300:60 --diameter 25 "
        "--center 60,0,0 --about 0,0,0 -o axis.ngc"
    )

    machine: MachinePath
    axis: Annotated[
        Literal["A", "B", "C"], Field(help="Rotary axis: A lies along x, B along y, C along z.")
    ]
    angles: Annotated[
        Angles,
        Field(
            help="Angles of the axis, in degrees, in their order: three or more.",
            metavar="ANGLES",
        ),
    ]
    diameter: SphereDiameter
    center: Annotated[
        Vector,
        Field(
            help="Centre of the sphere at the first angle, in work coordinates, in mm.",
            label="Centre of the sphere",
            metavar="X,Y,Z",
        ),
    ]
    about: Annotated[
        Vector,
        Field(
            help="A point on the axis, in work coordinates, in mm, anywhere along the axis.",
            metavar="X,Y,Z",
        ),
    ]
    sense: Annotated[
        Literal["against", "with"],
        Field(
            help="Sense in which the sphere turns when the angle increases, with or against the "
            "right-hand rule about the machine's axis: against it on a table.",
        ),
    ] = "against"
    turning_feed: Annotated[
        float, Field(help="Feed of the rotary axis, in degrees/min.", range=FEED)
    ] = 1000.0
    polar: Annotated[
        PolarAngles,
        Field(
            help="Polar angles of the rings, in degrees; 90 is the equator.",
            metavar="ANGLES",
        ),
    ] = PolarAngles(_RINGS_OF_AXIS)
    count: Annotated[
        int,
        Field(help="Touches on the equator; other rings are as dense.", range=(1, 10_000)),
    ] = _TOUCHES_AT_AN_ANGLE
    shank: Annotated[
        float,
        Field(
            help="Diameter of a vertical shank below the sphere, in mm; 0: none.",
            range=(0.0, 1000.0),
            unit="mm",
            only=(When("axis", ("C",)),),
        ),
    ] = 0.0

    def run(self, progress: Progress = SILENT) -> PlannedProgram:
        """Plan the touches at all angles, and the moves between them.

        Raises
        ------
        PretravelError
            As `plan_axis_program`.
        """
        import numpy as np

        from pretravel.base import ring_pattern
        from pretravel.controls.axis_program import TurnedSphere, plan_axis_program
        from pretravel.controls.surroundings import SphereObstacle
        from pretravel.files import read_machine

        _check_shank(self.shank, self.diameter)
        known = read_machine(self.machine)
        _check_tip(known, self.diameter)
        normals = ring_pattern([angle * DEGREE for angle in self.polar.degrees], self.count)
        obstacle = SphereObstacle(np.array(self.center), 0.5 * self.diameter, self.shank)
        sense = -1 if self.sense == "against" else 1
        with progress.working("planning"):
            program = plan_axis_program(
                TurnedSphere(self.axis, np.array(self.about), sense, obstacle),
                [angle * DEGREE for angle in self.angles.degrees],
                normals,
                known,
                turning_feed=self.turning_feed,
                feeds=self.feeds or (),
                repeats=self.repeats,
            )
        return _planned(self, program)


def _in_passes(count: int, passes: int) -> tuple[list[int], tuple[str, ...]]:
    """Directions in the order of the touches, and their labels: s1.2 in the second pass.

    Each pass has an order of its own, and no direction follows itself.
    """
    import numpy as np

    if passes == 1:
        return list(range(count)), tuple(f"s{i + 1}" for i in range(count))
    generator = np.random.default_rng(0)
    rows, labels = list[int](), list[str]()
    for number in range(passes):
        order = generator.permutation(count) if number else np.arange(count)
        if rows and count > 1 and order[0] == rows[-1]:
            order = np.roll(order, 1)
        rows += order.tolist()
        labels += [f"s{i + 1}.{number + 1}" for i in order.tolist()]
    return rows, tuple(labels)


def _check_shank(shank: float, diameter: float) -> None:
    if shank >= diameter:
        raise PretravelError(
            f"a shank of {shank:g} mm: it must be thinner than the sphere",
            inputs=("shank", "diameter"),
        )


def _check_tip(machine: Machine, diameter: float) -> None:
    tip = 2.0 * machine.tip_radius
    if tip > diameter:
        raise PretravelError(
            f"the tip ({tip:g} mm) is larger than the sphere ({diameter:g} mm): is the diameter in "
            "mm?",
            inputs=("diameter",),
        )


class ProgramPart(ProgramTask):
    """Touch the targets of a plan. Moves are checked against the faces of the part, if given."""

    name = "program part"
    example = "pretravel program part mill.toml plan.csv --surface part.step -o part.ngc"

    machine: MachinePath
    targets: Annotated[
        Path,
        Field(
            help="Targets, .csv, from pretravel plan or plan-touches.", positional=True, reads=True
        ),
    ]
    surface: Annotated[
        str | None,
        Field(
            help="The part, part.step: moves are checked against all its faces.",
            reads=surface_files,
            word=is_shape,
        ),
    ] = None
    compensated: Annotated[
        Path | None,
        Field(
            help="Compute surface points on the control, with the subroutines of pretravel export "
            "MAP --to linuxcnc; the program stops if the control has those of another map.",
            metavar="MAP",
            reads=True,
        ),
    ] = None
    allow_misses: Annotated[
        bool,
        Field(
            help="Continue after a touch without contact; stop if the first touch has none, or "
            "two in a row."
        ),
    ] = False
    leave_out: Annotated[bool, Field(help="Leave out targets that cannot be reached.")] = False
    approach: Approach = None

    def run(self, progress: Progress = SILENT) -> PlannedProgram:
        """Plan the moves between the targets.

        Raises
        ------
        PretravelError
            A surface that is not a part; targets that cannot be reached; as `plan_program`.
        """
        from pretravel.controls.program import plan_program
        from pretravel.controls.surroundings import PartObstacle
        from pretravel.files import read_machine, read_targets

        known = read_machine(self.machine)
        part = None if self.surface is None else _part(self.surface)
        plan = read_targets(self.targets, approach=self.approach)
        with progress.working(f"planning {len(plan)} touches"):
            program = plan_program(
                plan,
                known,
                title=self.targets.stem,
                feeds=self.feeds or (),
                repeats=self.repeats,
                obstacles=[] if part is None else [PartObstacle(part)],
                leave_out=self.leave_out,
            )
        planned = _planned(self, program, self.compensated, allow_misses=self.allow_misses)
        told = [*plan.unused]
        if plan.feed is not None and set(program.feeds) != {plan.feed}:
            feeds = ", ".join(f"{feed:g}" for feed in sorted(set(program.feeds)))
            told.append(
                f"{self.targets.name} has a feed of {plan.feed:g} mm/min (feed_mm_min), the "
                f"program touches at {feeds} mm/min"
            )
        return replace(planned, cautions=(*planned.cautions, *told))


def _part(surface: str) -> Part:
    from pretravel.surface import Part, parse_surface

    shape = parse_surface(surface)
    if not isinstance(shape, Part):
        raise PretravelError(
            f"{surface}: moves are checked against a STEP or IGES file (part.step)",
            inputs=("surface",),
        )
    return shape


@dataclass(frozen=True, eq=False)
class PlannedProgram(Result):
    """A program and what is known of its moves.

    Attributes
    ----------
    program : ProbingProgram
    content : str
        The program for the control.
    text : str
        Touches and duration, and what was checked.
    cautions : tuple of str
        What was not.
    """

    program: ProbingProgram
    content: str
    text: str
    cautions: tuple[str, ...] = ()

    def write(self, output: str, path: Path) -> None:
        """Write the program."""
        del output
        from pretravel.base import write_text

        write_text(path, self.content, "ascii")


def _planned(
    task: ProgramTask,
    program: ProbingProgram,
    compensated: Path | None = None,
    *,
    allow_misses: bool = False,
) -> PlannedProgram:
    from pretravel.controls.linuxcnc_programs import linuxcnc_program
    from pretravel.controls.linuxcnc_state import HANDLER
    from pretravel.files import read_map

    pretravel_map = None if compensated is None else read_map(compensated)
    content = linuxcnc_program(
        program,
        task.log_name,
        compensated=pretravel_map,
        allow_misses=allow_misses,
        spindle=None if task.spindle_deg is None else task.spindle_deg * DEGREE,
        by_hand=task.by_hand,
        written=date.today().isoformat(),
    )
    minutes = program.duration / 60.0
    where = f"log: {task.log_name}, next to the machine's INI file"
    lines = [
        f"{len(program)} touches, about {minutes:.1f} min; {where}",
        (
            "the control needs the subroutines of pretravel program mdi and this line in its INI "
            f"file: {HANDLER}"
        ),
        *(f"checked: {statement}" for statement in program.checked),
    ]
    warnings = []
    if pretravel_map is not None and pretravel_map.delay is None and pretravel_map.feed is None:
        warnings.append(
            f"{compensated} has no feed: the points hold only if the probe was qualified at "
            "the feed of this program"
        )
    if pretravel_map is not None and (turn := _unknown_turn(pretravel_map, task.spindle_deg)):
        warnings.append(turn)
    if program.left_out:
        more = "…" if len(program.left_out) > _NAMED else ""
        names = ", ".join(program.left_out[:_NAMED]) + more
        count = len(program.left_out)
        warnings.append(f"{count} targets left out that cannot be reached: {names}")
    warnings += [f"not checked: {statement}" for statement in program.unchecked]
    return PlannedProgram(program, content, "\n".join(lines) + "\n", tuple(warnings))


def _unknown_turn(pretravel_map: PretravelMap, spindle_deg: float | None) -> str:
    """What holds where the map or the program has no orientation of the spindle."""
    from pretravel.maps import error_of_a_turn

    made_at, size = pretravel_map.provenance.spindle_deg, error_of_a_turn(pretravel_map)
    if (made_at is None) == (spindle_deg is None) or size == 0.0:
        return ""
    who = (
        f"the map is of spindle {made_at:g}°, and the program does not orient the spindle"
        if spindle_deg is None
        else f"the program orients the spindle to {spindle_deg:g}°, and the map has no orientation"
    )
    return f"{who}: at another orientation points are wrong by up to {size * 1e3:.1f} µm"


class ProgramMdi(Task):
    """Write the subroutines that all programs need, and pretravel_sphere for MDI.

    Typed as one MDI line, pretravel_sphere touches a reference sphere, for pretravel qualify.

    The command needs neither a map nor a machine file. With a map, pretravel export --to linuxcnc
    writes pretravel_sphere, too, together with the cycles that compensate.
    """

    name = "program mdi"
    example = "pretravel program mdi -o subroutines"

    output: Annotated[Path, output("Folder for the subroutines, on SUBROUTINE_PATH.", *FOLDER)]
    tool: ToolOfSubroutines = None
    stylus_length: StylusOfSubroutines = 50.0

    def run(self, progress: Progress = SILENT) -> Subroutines:
        """The subroutines."""
        del progress
        from pretravel.controls.linuxcnc_cycles import sphere_subroutines

        refuse_no_folder(self.output)
        texts = sphere_subroutines(self.tool, self.stylus_length)
        return Subroutines(texts, f"{self.output}: {', '.join(sorted(texts))}\n")


@dataclass(frozen=True)
class Subroutines(Result):
    """Texts of subroutines.

    Attributes
    ----------
    texts : mapping of str to str
        By the names of their files.
    text : str
        Their names.
    """

    texts: Mapping[str, str]
    text: str

    def write(self, output: str, path: Path) -> None:
        """Write a file for each in a folder."""
        del output
        from pretravel.base import write_texts

        write_texts(path, self.texts, "ascii")
