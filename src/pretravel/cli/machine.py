from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import check_files
from pretravel.cli.options import Units

_LARGEST_TIP = 30.0  # mm


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
        typer.Option(help="Tool table of LinuxCNC (.tbl), for the diameter of the tip."),
    ] = None,
    tool: Annotated[int | None, typer.Option(help="Number of the probe in the tool table.")] = None,
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
    from dataclasses import replace

    from pretravel.controls.machine import Machine
    from pretravel.errors import PretravelError
    from pretravel.formats.linuxcnc_files import read_tool, read_work_offset
    from pretravel.formats.machine_file import machine_text
    from pretravel.whole_file import whole_file

    if tools is not None and tool is None:
        raise PretravelError(f"--tools {tools}: say which is the probe, --tool NUMBER")
    check_files([(output, (".toml",))], [parameters, tools])
    found = Machine(tool=tool or 0)
    if parameters is not None:
        name, work = read_work_offset(parameters, offset, units)
        found = replace(found, work_offset=name, work=work)
    elif offset is not None:
        found = replace(found, work_offset=offset.upper())
    if tools is not None and tool is not None:
        entry = read_tool(tools, tool, units)
        if not 0.1 <= entry.diameter <= _LARGEST_TIP:
            raise PretravelError(
                f"{tools}: T{tool} has a diameter of {entry.diameter:g} mm, which is no tip's; put "
                "it into the table (D), say --units, or leave --tools out and edit the file"
            )
        stem = min(found.stem_diameter, 0.75 * entry.diameter)
        found = replace(found, tip_diameter=entry.diameter, stem_diameter=stem)
    if output is None:
        typer.echo(machine_text(found), nl=False)
        return
    with whole_file(output) as temporary:
        temporary.write_text(machine_text(found), encoding="utf-8")
    typer.echo(f"{output}: look at every line of it")
