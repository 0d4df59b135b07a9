"""Make a machine file to edit: probe, feeds, safe height, work offset."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import PretravelError
from pretravel.task import SILENT, Field, Progress, Task, TextResult, Units, output

if TYPE_CHECKING:
    from pretravel.files import Machine

_SMALLEST_TIP, _LARGEST_TIP = 0.1, 30.0
"""Diameters of tips. [mm]"""


class MachineFile(Task):
    """Print a machine file to edit, for pretravel program: probe, feeds, heights, work offset."""

    name = "machine"
    example = "pretravel machine --var linuxcnc.var --tools tool.tbl --tool 99 > mill.toml"

    parameters: Annotated[
        Path | None,
        Field(
            help="Parameter file of LinuxCNC (.var), for the work offset.",
            option="--var",
            reads=True,
        ),
    ] = None
    offset: Annotated[
        str | None, Field(help="Work offset, G54 to G59.3; the default is the last active one.")
    ] = None
    tools: Annotated[
        Path | None,
        Field(help="Tool table of LinuxCNC (.tbl), for tip diameter and tool length.", reads=True),
    ] = None
    tool: Annotated[
        int | None,
        Field(help="Number of the probe in the tool table.", range=(0, 99_999), only=("tools",)),
    ] = None
    units: Annotated[
        Units,
        Field(help="Unit of length in the files of the machine.", only=("parameters", "tools")),
    ] = "mm"
    output: Annotated[
        Path | None, output("Machine file: .toml; the default is to print it.", ".toml")
    ] = None

    def run(self, progress: Progress = SILENT) -> TextResult:
        """The text of the machine file.

        Raises
        ------
        PretravelError
            A tool table without the number of the probe, or the reverse; a tool that cannot be a
            probe; files that cannot be read.
        """
        del progress
        from pretravel.controls.machine_text import machine_text

        content = machine_text(self.machine())
        if self.output is None:
            return TextResult(content)
        return TextResult(f"{self.output}: check every line of it\n", content)

    def machine(self) -> Machine:
        """The machine, with what its own files state."""
        from pretravel.controls.linuxcnc_files import read_work_offset
        from pretravel.files import Machine

        if self.tools is not None and self.tool is None:
            raise PretravelError(
                f"{self.tools}: give the number of the probe in the tool table too",
                inputs=("tools", "tool"),
            )
        found = Machine(tool=self.tool)
        if self.parameters is not None:
            name, work = read_work_offset(self.parameters, self.offset, self.units)
            found = replace(found, work_offset=name, work=work)
        elif self.offset is not None:
            found = replace(found, work_offset=self.offset.upper())
        if self.tools is not None:
            found = _with_tool(found, self.tools, self.units)
        return found


def _with_tool(found: Machine, tools: Path, units: Units) -> Machine:
    """The machine with the length and the tip's diameter of a tool table."""
    from pretravel.controls.linuxcnc_files import read_tool

    assert found.tool is not None
    tool = read_tool(tools, found.tool, units)
    if not _SMALLEST_TIP <= tool.diameter <= _LARGEST_TIP:
        raise PretravelError(
            f"{tools}: T{found.tool} has a diameter of {tool.diameter:g} mm, which cannot be that "
            "of a tip; correct it in the table (D), give its unit, or leave the table out and "
            "edit the file",
            inputs=("units", "tools"),
        )
    if tool.length == 0.0:
        raise PretravelError(
            f"{tools}: T{found.tool} has no length (Z) in the table: measure it to the centre of "
            "the ball, or leave table and number out for a probe without tool length",
            inputs=("tools", "tool"),
        )
    stem = min(found.stem_diameter, 0.75 * tool.diameter)
    return replace(found, tip_diameter=tool.diameter, stem_diameter=stem, tool_length=tool.length)
