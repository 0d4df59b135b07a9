from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import ANGLE, limits
from pretravel.base.units import DEGREE
from pretravel.cli.arguments import Angles, Feeds, Vector, feeds_list, one_of, polar_angles, vector
from pretravel.cli.command import Command
from pretravel.cli.files import check_files
from pretravel.cli.options import Approach
from pretravel.cli.progress import working

if TYPE_CHECKING:
    from pretravel.base.arrays import FloatArray
    from pretravel.controls.program import ProbingProgram

app = typer.Typer(
    name="program",
    help="Write a probing program (G-code for LinuxCNC) that logs every touch.",
    no_args_is_help=True,
    add_completion=False,
)


def _patterns() -> list[str]:
    from pretravel.laboratory.standards import PATTERNS

    return ["rings", *PATTERNS]


MachineFile = Annotated[
    Path, typer.Argument(help="Machine file: pretravel machine > mill.toml writes one to edit.")
]
Output = Annotated[Path, typer.Option("--output", "-o", help="Program: .ngc.")]
Log = Annotated[
    str | None,
    typer.Option(
        help="Log file on the machine, relative to its INI file; the default is the name of the "
        "program with the ending .log."
    ),
]
Repeats = Annotated[
    int, typer.Option(min=1, max=1000, help="Repeats of each touch, one after the other.")
]
FeedsOption = Annotated[
    Feeds | None,
    typer.Option(
        parser=feeds_list,
        metavar="FEEDS",
        help="Measuring feeds a,b,…, in mm/min: every touch is made at each; the default is that "
        "of the machine file.",
    ),
]
_RINGS = Angles.of("0,20,40,60,75,90")
_ENDINGS = (".ngc", ".nc", ".gcode", ".tap")


@app.command(
    cls=Command,
    epilog="Example: pretravel program sphere mill.toml --diameter 24.9987 -o sphere.ngc",
)
def sphere(
    machine: MachineFile,
    diameter: Annotated[
        float, typer.Option(min=0.001, max=1000.0, help="Diameter of the sphere, in mm.")
    ],
    output: Output,
    pattern: Annotated[
        str,
        typer.Option(
            parser=one_of(_patterns),
            metavar="PATTERN",
            help="rings (--polar, --count), iso10360-5 (25 touches) or iso230-10 (36 on the "
            "equator).",
        ),
    ] = "rings",
    polar: Annotated[
        Angles | None,
        typer.Option(
            parser=polar_angles,
            metavar="ANGLES",
            help="Polar angles of the rings, in degrees; 90 is the equator; the default is "
            "0,20,40,60,75,90.",
        ),
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=10_000,
            help="Touches on the equator; other rings are as dense; the default is 24.",
        ),
    ] = None,
    center: Annotated[
        Vector,
        typer.Option(
            parser=vector,
            metavar="X,Y,Z",
            help="Centre of the sphere in work coordinates, in mm.",
        ),
    ] = Vector(0, 0, 0),
    shank: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1000.0,
            help="Diameter of a vertical shank below the sphere, in mm; 0: none.",
        ),
    ] = 0.0,
    turn: Annotated[
        float,
        typer.Option(
            **limits(ANGLE, DEGREE),
            help="Rotation of the pattern about the probe axis, in degrees.",
        ),
    ] = 0.0,
    repeats: Repeats = 1,
    feeds: FeedsOption = None,
    log: Log = None,
) -> None:
    """Touch a reference sphere in all directions, for pretravel qualify.

    The centre of the sphere is the origin of the work offset (or --center), to about 1 mm.
    """
    import numpy as np

    from pretravel.base.frames import probe_rotation
    from pretravel.controls.program import plan_program
    from pretravel.controls.surroundings import SphereObstacle
    from pretravel.files.machine_file import read_machine
    from pretravel.probing.targets import Targets

    check_files([(output, _ENDINGS)], [machine], programs=True)
    if shank >= diameter:
        raise PretravelError(f"--shank {shank:g}: the shank must be thinner than the sphere")
    known = read_machine(machine)
    normals = _directions(pattern, polar, count) @ probe_rotation(rotation=turn * DEGREE).T
    middle = np.array(center)
    labels = tuple(f"s{i + 1}" for i in range(len(normals)))
    targets = Targets(middle + 0.5 * diameter * normals, normals, labels=labels)
    with working("planning"):
        program = plan_program(
            targets,
            known,
            title=f"sphere of {diameter:g} mm around X{center.x:g} Y{center.y:g} Z{center.z:g}",
            feeds=feeds or (),
            repeats=repeats,
            obstacles=[SphereObstacle(middle, 0.5 * diameter, shank)],
        )
    _write(program, output, log)


def _directions(pattern: str, polar: Angles | None, count: int | None) -> FloatArray:
    """Directions of a pattern of touches; polar angles and count are those of rings."""
    from pretravel.base.directions import ring_pattern
    from pretravel.laboratory.standards import PATTERNS

    if pattern == "rings":
        rings = [angle * DEGREE for angle in (polar or _RINGS).degrees]
        return ring_pattern(rings, 24 if count is None else count)
    if polar is not None or count is not None:
        raise PretravelError(f"--polar and --count are only for --pattern rings, not {pattern}")
    return PATTERNS[pattern]()


@app.command(
    cls=Command,
    epilog="Example: pretravel program part mill.toml plan.csv --surface part.step -o part.ngc",
)
def part(
    machine: MachineFile,
    targets: Annotated[Path, typer.Argument(help="Targets, .csv, from pretravel plan.")],
    output: Output,
    surface: Annotated[
        str | None,
        typer.Option(help="The part, part.step: moves are checked against all its faces."),
    ] = None,
    compensated: Annotated[
        Path | None,
        typer.Option(
            metavar="MAP",
            help="Compute surface points on the control, with the subroutines of pretravel export "
            "MAP --to linuxcnc; the program stops where the control has those of another map.",
        ),
    ] = None,
    allow_misses: Annotated[
        bool,
        typer.Option(
            "--allow-misses",
            help="Go on after a touch without contact; not after the first touch, and not after "
            "two in a row.",
        ),
    ] = False,
    leave_out: Annotated[
        bool,
        typer.Option("--leave-out", help="Leave out targets that cannot be reached."),
    ] = False,
    approach: Approach = "normal",
    repeats: Repeats = 1,
    feeds: FeedsOption = None,
    log: Log = None,
) -> None:
    """Touch the targets of a plan, with moves between them that are free of collisions."""
    from pretravel.controls.program import plan_program
    from pretravel.controls.surroundings import PartObstacle
    from pretravel.files.machine_file import read_machine
    from pretravel.files.touches_csv import read_targets
    from pretravel.surface.cad.part import Part
    from pretravel.surface.specification import parse_surface, source_file

    files = [] if surface is None else source_file(surface)
    check_files([(output, _ENDINGS)], [machine, targets, compensated, *files], programs=True)
    known = read_machine(machine)
    shape = None if surface is None else parse_surface(surface)
    if shape is not None and not isinstance(shape, Part):
        raise PretravelError(
            f"--surface {surface}: moves are checked against a STEP or IGES file (part.step)"
        )
    plan = read_targets(targets, approach=approach)
    with working(f"planning {len(plan)} touches"):
        program = plan_program(
            plan,
            known,
            title=targets.stem,
            feeds=feeds or (),
            repeats=repeats,
            obstacles=[] if shape is None else [PartObstacle(shape)],
            leave_out=leave_out,
        )
    _write(program, output, log, compensated=compensated, allow_misses=allow_misses)


@app.command(cls=Command, epilog="Example: pretravel program mdi -o subroutines")
def mdi(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder of subroutines, of SUBROUTINE_PATH.")
    ],
) -> None:
    """Write pretravel_sphere: touches on any reference sphere, called from MDI.

    It needs neither a map nor a machine file. pretravel export --to linuxcnc writes it too, with
    cycles that need a map.
    """
    from pretravel.base.whole_file import write_texts
    from pretravel.controls.linuxcnc_cycles import sphere_subroutines

    if output.suffix or output.is_file():
        raise PretravelError(f"-o {output}: a folder is needed; it takes several subroutines")
    if not output.parent.is_dir():
        raise PretravelError(f"cannot make {output}: the folder {output.parent} does not exist")
    texts = sphere_subroutines()
    write_texts(output, texts, "ascii")
    typer.echo(f"{output}: {', '.join(sorted(texts))}")


def _write(
    program: ProbingProgram,
    output: Path,
    log: str | None,
    *,
    compensated: Path | None = None,
    allow_misses: bool = False,
) -> None:
    from pretravel.base.whole_file import write_text
    from pretravel.controls.linuxcnc_program import linuxcnc_program
    from pretravel.files.map_file import read_map

    name = log or f"{output.stem}.log"
    pretravel_map = None if compensated is None else read_map(compensated)
    text = linuxcnc_program(program, name, compensated=pretravel_map, allow_misses=allow_misses)
    write_text(output, text, "ascii")
    typer.echo(
        f"{len(program)} touches, about {program.duration / 60.0:.1f} min; they are logged to "
        f"{name} beside the machine's INI file"
    )
    if pretravel_map is not None and pretravel_map.delay is None and pretravel_map.feed is None:
        typer.echo(
            f"Warning: {compensated} states no feed: the points hold only if the probe was "
            "qualified at the feed of this program",
            err=True,
        )
    if program.left_out:
        names = ", ".join(program.left_out[:20]) + ("…" if len(program.left_out) > 20 else "")
        count = len(program.left_out)
        typer.echo(f"Warning: {count} targets left out that cannot be reached: {names}", err=True)
    for property_ in program.checked:
        typer.echo(f"checked: {property_}")
    for property_ in program.unchecked:
        typer.echo(f"Warning: not checked: {property_}", err=True)
