from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.cli.arguments import angle_range, check_files, vector, working
from pretravel.cli.command import Command

if TYPE_CHECKING:
    from pretravel.controls.program import ProbingProgram

app = typer.Typer(
    name="program",
    help="Write a probing program (G-code of LinuxCNC) that logs every touch.",
    no_args_is_help=True,
    add_completion=False,
)

MachineFile = Annotated[
    Path, typer.Argument(help="Machine file: pretravel machine > mill.toml writes one to edit.")
]
Output = Annotated[Path, typer.Option("--output", "-o", help="Program: .ngc.")]
Log = Annotated[
    str | None,
    typer.Option(
        help="Log file on the machine, relative to its INI file; the program's name with .log."
    ),
]
Repeats = Annotated[int, typer.Option(help="Of each touch, in a row.")]
Feeds = Annotated[
    str | None,
    typer.Option(help="Measuring feeds a,b,…, mm/min: every touch at each; else the machine's."),
]
_RINGS = "0,20,40,60,75,90"
_ENDINGS = (".ngc", ".nc", ".gcode", ".tap")


@app.command(
    cls=Command,
    epilog="Example: pretravel program sphere mill.toml --diameter 24.9987 -o sphere.ngc",
)
def sphere(
    machine: MachineFile,
    diameter: Annotated[float, typer.Option(help="Of the reference sphere, mm.")],
    output: Output,
    pattern: Annotated[
        str,
        typer.Option(
            help="rings (--polar, --count), iso10360-5 (25 touches), iso230-10 (36 on the equator)."
        ),
    ] = "rings",
    polar: Annotated[
        str | None,
        typer.Option(
            help="Of the rings, degrees from the pole, 90 is the equator; 0,20,40,60,75,90."
        ),
    ] = None,
    count: Annotated[
        int | None, typer.Option(help="Touches on the equator, other rings as dense; 24.")
    ] = None,
    center: Annotated[
        str, typer.Option(help="Centre of the sphere x,y,z in work coordinates, mm.")
    ] = "0,0,0",
    shank: Annotated[
        float, typer.Option(help="Diameter of a shank straight down from the sphere, mm; 0: none.")
    ] = 0.0,
    turn: Annotated[float, typer.Option(help="Of the pattern about the axis, degrees.")] = 0.0,
    repeats: Repeats = 1,
    feeds: Feeds = None,
    log: Log = None,
) -> None:
    """Touch a reference sphere all around: what pretravel qualify needs.

    The work offset's origin (or --center) is the sphere's centre, right to about a millimetre.
    """
    import numpy as np

    from pretravel.controls.program import SphereObstacle, plan_program
    from pretravel.directions import ring_pattern
    from pretravel.errors import PretravelError
    from pretravel.formats.machine_file import read_machine
    from pretravel.frames import probe_rotation
    from pretravel.laboratory.standards import PATTERNS
    from pretravel.probing.targets import Targets
    from pretravel.units import DEGREE

    check_files([(output, _ENDINGS)], [machine])
    if not 0.0 < diameter < 1000.0:
        raise PretravelError(f"--diameter {diameter:g}: it must be positive, in mm")
    if shank < 0.0 or shank >= diameter:
        raise PretravelError(f"--shank {shank:g}: a shank is thinner than its sphere")
    if pattern == "rings":
        rings = [angle * DEGREE for angle in angle_range(polar or _RINGS, "--polar")]
        directions = ring_pattern(rings, 24 if count is None else count)
    elif polar is not None or count is not None:
        raise PretravelError(f"--polar and --count go with --pattern rings, not {pattern}")
    elif pattern in PATTERNS:
        directions = PATTERNS[pattern]()
    else:
        raise PretravelError(f"--pattern {pattern}: it is rings, {' or '.join(PATTERNS)}")
    known = read_machine(machine)
    normals = directions @ probe_rotation(rotation=turn * DEGREE).T
    middle = np.array(vector(center, "--center"))
    targets = Targets(
        middle + 0.5 * diameter * normals,
        normals,
        labels=tuple(f"s{i + 1}" for i in range(len(normals))),
    )
    with working("planning"):
        program = plan_program(
            targets,
            known,
            title=f"sphere of {diameter:g} mm",
            feeds=_feeds(feeds),
            repeats=repeats,
            obstacles=[SphereObstacle(middle, 0.5 * diameter, shank)],
        )
    _write(program, output, log, compensated=False)


@app.command(
    epilog="Example: pretravel program part mill.toml plan.csv --surface part.step -o part.ngc"
)
def part(
    machine: MachineFile,
    targets: Annotated[Path, typer.Argument(help="Targets: .csv, as pretravel plan writes them.")],
    output: Output,
    surface: Annotated[
        str | None,
        typer.Option(help="The part, part.step: moves are checked against all of its faces."),
    ] = None,
    compensated: Annotated[
        bool,
        typer.Option(
            "--compensated",
            help="Surface points on the control too, by the subroutines of pretravel export "
            "--to linuxcnc.",
        ),
    ] = False,
    leave_out: Annotated[
        bool,
        typer.Option("--leave-out", help="Targets that cannot be reached, instead of refusing."),
    ] = False,
    approach: Annotated[
        str, typer.Option(help="normal, or file: by its columns ax,ay,az.")
    ] = "normal",
    repeats: Repeats = 1,
    feeds: Feeds = None,
    log: Log = None,
) -> None:
    """Touch the targets of a plan, each from its side, with free ways between them."""
    from pretravel.controls.program import PartObstacle, plan_program
    from pretravel.errors import PretravelError
    from pretravel.formats.machine_file import read_machine
    from pretravel.formats.touches_csv import read_targets
    from pretravel.surface.cad.part import Part
    from pretravel.surface.shapes import Plane
    from pretravel.surface.specification import parse_surface, source_file

    files = [] if surface is None else source_file(surface)
    check_files([(output, _ENDINGS)], [machine, targets, *files])
    known = read_machine(machine)
    shape = None if surface is None else parse_surface(surface)
    if shape is not None and not isinstance(shape, Part):
        raise PretravelError(
            f"--surface {surface}: moves are checked against a STEP file (part.step)"
        )
    # A surface is asked for points only where the file has none.
    plan = read_targets(
        targets, Plane([0, 0, 0], [0, 0, 1]) if shape is None else shape, approach=approach
    )
    with working(f"planning {len(plan)} touches"):
        program = plan_program(
            plan,
            known,
            title=targets.stem,
            feeds=_feeds(feeds),
            repeats=repeats,
            obstacles=[] if shape is None else [PartObstacle(shape)],
            leave_out=leave_out,
        )
    _write(program, output, log, compensated=compensated)


def _feeds(text: str | None) -> list[float]:
    from pretravel.cli.arguments import number

    return [] if text is None else [number(word, "--feeds") for word in text.split(",")]


def _write(program: ProbingProgram, output: Path, log: str | None, *, compensated: bool) -> None:
    from pretravel.controls.linuxcnc import linuxcnc_program
    from pretravel.whole_file import whole_file

    name = log or f"{output.stem}.log"
    text = linuxcnc_program(program, name, compensated=compensated)
    with whole_file(output) as temporary:
        temporary.write_text(text, encoding="ascii")
    typer.echo(
        f"{len(program)} touches, about {program.duration / 60.0:.1f} min; they are logged to "
        f"{name} beside the machine's INI file"
    )
    if program.left_out:
        names = ", ".join(program.left_out[:20]) + ("…" if len(program.left_out) > 20 else "")
        count = len(program.left_out)
        typer.echo(f"Warning: {count} targets left out that cannot be reached: {names}", err=True)
    for told in program.checked:
        typer.echo(f"checked: {told}")
    for told in program.unchecked:
        typer.echo(f"Warning: not checked: {told}", err=True)
