from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def machine(
    parameters: Annotated[
        Path | None,
        typer.Option("--var", help="Parameter file of LinuxCNC (.var): the work offset's place."),
    ] = None,
    offset: Annotated[
        str | None, typer.Option(help="Work offset G54 to G59.3; else the one last active.")
    ] = None,
    tools: Annotated[
        Path | None, typer.Option(help="Tool table of LinuxCNC (.tbl): the tip's diameter.")
    ] = None,
    tool: Annotated[int, typer.Option(help="Number of the probe in it.")] = 0,
    units: Annotated[str, typer.Option(help="Of the machine's own files: mm or inch.")] = "mm",
) -> None:
    """Print a machine file to edit: probe, feeds, safe height, work offset.

    Example: pretravel machine --var linuxcnc.var --tools tool.tbl --tool 99 > mill.toml
    """
    from dataclasses import replace

    from pretravel.controls.machine import Machine
    from pretravel.errors import PretravelError
    from pretravel.formats.linuxcnc_files import read_tool, read_work_offset
    from pretravel.formats.machine_file import machine_text
    from pretravel.formats.readings import UNITS

    if units not in UNITS:
        raise PretravelError(f"--units {units}: it is mm or inch")
    found = Machine(tool=tool)
    if parameters is not None:
        name, work = read_work_offset(parameters, offset, units)
        found = replace(found, work_offset=name, work=work)
    elif offset is not None:
        found = replace(found, work_offset=offset.upper())
    if tools is not None:
        entry = read_tool(tools, tool, units)
        if entry.diameter > 0.0:
            stem = min(found.stem_diameter, 0.75 * entry.diameter)
            found = replace(found, tip_diameter=entry.diameter, stem_diameter=stem)
    typer.echo(machine_text(found), nl=False)
