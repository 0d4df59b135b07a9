from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.errors import PretravelError
from pretravel.cli.files import check_files
from pretravel.cli.options import Units

if TYPE_CHECKING:
    from pretravel.controls.machine import Machine

_SMALLEST_TIP, _LARGEST_TIP = 0.1, 30.0
"""Diameters of tips. [mm]"""


def machine(
    parameters: Annotated[
        Path | None,
        typer.Option("--var", help="Parameter file of LinuxCNC (.var), for the work offset."),
    ] = None,
    offset: Annotated[
        str | None,
        typer.Option(help="Work offset, G54 to G59.3; the default is the last active one."),
    ] = None,
    tools: Annotated[
        Path | None,
        typer.Option(help="Tool table of LinuxCNC (.tbl), for tip diameter and tool length."),
    ] = None,
    tool: Annotated[
        int | None, typer.Option(min=0, max=99_999, help="Number of the probe in the tool table.")
    ] = None,
    units: Annotated[
        Units, typer.Option(help="Unit of length in the files of the machine.")
    ] = "mm",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Machine file: .toml; the default is to print it."),
    ] = None,
) -> None:
    """Print a machine file to edit: probe, feeds, safe height, work offset.

    Example: pretravel machine --var linuxcnc.var --tools tool.tbl --tool 99 > mill.toml
    """
    from pretravel.base.whole_file import write_text
    from pretravel.controls.machine import Machine
    from pretravel.files.linuxcnc_files import read_work_offset
    from pretravel.files.machine_file import machine_text

    if tools is not None and tool is None:
        raise PretravelError(f"--tools {tools}: give the number of the probe too, --tool NUMBER")
    if tool is not None and tools is None:
        raise PretravelError(
            f"--tool {tool}: give the tool table too, --tools tool.tbl, for the length of the tool"
        )
    check_files([(output, (".toml",))], [parameters, tools])
    found = Machine(tool=tool)
    if parameters is not None:
        name, work = read_work_offset(parameters, offset, units)
        found = replace(found, work_offset=name, work=work)
    elif offset is not None:
        found = replace(found, work_offset=offset.upper())
    if tools is not None:
        found = _with_tool(found, tools, units)
    if output is None:
        typer.echo(machine_text(found), nl=False)
        return
    write_text(output, machine_text(found))
    typer.echo(f"{output}: check every line of it")


def _with_tool(found: Machine, tools: Path, units: Units) -> Machine:
    """The machine with the length and the tip's diameter of a tool table."""
    from pretravel.files.linuxcnc_files import read_tool

    assert found.tool is not None
    tool = read_tool(tools, found.tool, units)
    if not _SMALLEST_TIP <= tool.diameter <= _LARGEST_TIP:
        raise PretravelError(
            f"{tools}: T{found.tool} has a diameter of {tool.diameter:g} mm, which cannot be that "
            "of a tip; correct it in the table (D), give --units, or leave --tools out and edit "
            "the file"
        )
    if tool.length == 0.0:
        raise PretravelError(
            f"{tools}: T{found.tool} has no length (Z) in the table: measure it to the centre of "
            "the ball, or leave --tools and --tool out for a probe without tool length"
        )
    stem = min(found.stem_diameter, 0.75 * tool.diameter)
    return replace(found, tip_diameter=tool.diameter, stem_diameter=stem, tool_length=tool.length)
