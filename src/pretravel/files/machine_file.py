"""The machine file: the machine data that a probing program uses, as TOML."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import (
    FloatArray,
    Placement,
    PretravelError,
    TomlDocument,
    TomlStructure,
    quoted,
    read_toml,
)
from pretravel.files.machine import Machine, work_placement

_USUAL = Machine()


@dataclass(frozen=True)
class _NameTable:
    name: str = _USUAL.name


class _ToolNumber:
    """The number of a tool; None for the word none."""

    def __init__(self, value: object) -> None:
        whole = isinstance(value, int) and not isinstance(value, bool)
        if not whole and value != "none":
            raise ValueError(
                f'must be the number of the probe in the tool table, or "none", got {quoted(value)}'
            )
        self.number = value if isinstance(value, int) else None


@dataclass(frozen=True)
class _ProbeTable:
    tool: _ToolNumber
    tip_diameter: float
    stem_diameter: float
    stylus_length: float
    body_diameter: float
    tool_length: float | None = None
    change_height: float | None = None


@dataclass(frozen=True)
class _FeedsTable:
    measuring_feed: float
    positioning_feed: float
    travel_feed: float = 0.0
    acceleration: float = _USUAL.acceleration


@dataclass(frozen=True)
class _DistancesTable:
    safe_height: float
    start_distance: float = _USUAL.start_distance
    overtravel: float = _USUAL.overtravel
    clearance: float = _USUAL.clearance


@dataclass(frozen=True)
class _WorkTable:
    work_offset: str
    x: float | None = None
    y: float | None = None
    z: float | None = None
    rotation: float | None = None


@dataclass(frozen=True)
class _LimitsTable:
    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]


@dataclass(frozen=True)
class _Tables:
    """All tables of the file. What moves are made and checked with is never assumed."""

    probe: _ProbeTable
    feeds: _FeedsTable
    distances: _DistancesTable
    work: _WorkTable
    machine: _NameTable = field(default_factory=_NameTable)
    limits: _LimitsTable | None = None


_STRUCTURE = TomlStructure(hint="pretravel machine prints a whole file to edit")
_STRUCTURE.value(_ToolNumber, _ToolNumber)
_STRUCTURE.table(
    _ProbeTable,
    tool_length="tool_length_mm",
    change_height="change_height_mm",
    tip_diameter="tip_diameter_mm",
    stem_diameter="stem_diameter_mm",
    stylus_length="stylus_length_mm",
    body_diameter="body_diameter_mm",
)
_STRUCTURE.table(
    _FeedsTable,
    measuring_feed="measuring_mm_min",
    positioning_feed="positioning_mm_min",
    travel_feed="travel_mm_min",
    acceleration="acceleration_mm_s2",
)
_STRUCTURE.table(
    _DistancesTable,
    safe_height="safe_height_mm",
    start_distance="start_mm",
    overtravel="overtravel_mm",
    clearance="clearance_mm",
)
_STRUCTURE.table(
    _WorkTable, work_offset="offset", x="x_mm", y="y_mm", z="z_mm", rotation="rotation_deg"
)
_STRUCTURE.table(_LimitsTable, x="x_mm", y="y_mm", z="z_mm")


def read_machine(path: str | Path) -> Machine:
    r"""Read a machine from its file.

    Parameters
    ----------
    path : str or Path
        TOML, as `pretravel.controls.machine_text.machine_text` writes it.

    Returns
    -------
    Machine

    Raises
    ------
    InputError
        Not TOML, tables or keys that are unknown or missing, values of the wrong type or
        size, with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "mill.toml"
    >>> from pretravel.controls.machine_text import machine_text
    >>> _ = file.write_text(machine_text(Machine(measuring_feed=30.0)))
    >>> read_machine(file).measuring_feed
    30.0
    """
    document = read_toml(path, "machine file", "pretravel machine > mill.toml writes one to edit")
    tables = _STRUCTURE.make(document, _Tables)
    try:
        machine = Machine(
            **vars(tables.machine),
            **_probe(tables.probe, document),
            **vars(tables.feeds),
            **vars(tables.distances),
            work_offset=tables.work.work_offset,
            work=_work(tables.work, document),
            limits=_limits(tables.limits),
        )
    except PretravelError as error:
        raise document.error(str(error), *_place(error.inputs)) from None
    measuring, positioning = machine.measuring_feed, machine.positioning_feed
    if measuring > positioning:
        raise document.error(
            f"the measuring feed, {measuring:g} mm/min, is larger than the positioning feed, "
            f"{positioning:g} mm/min: are the two exchanged?",
            *_place(("measuring_feed",)),
        )
    return machine


def _probe(table: _ProbeTable, document: TomlDocument) -> dict[str, Any]:
    """The parameters of `Machine` for the probe; a tool needs its length."""
    tool = table.tool.number
    if tool is not None and table.tool_length is None:
        raise document.error(
            f"[probe] needs tool_length_mm, the length of T{tool} in the tool table: the program "
            "stops where another length is active",
            "probe",
        )
    return {**vars(table), "tool": tool, "tool_length": table.tool_length or 0.0}


def _work(table: _WorkTable, document: TomlDocument) -> Placement | None:
    """The place of the work coordinates, which the table may leave open."""
    x, y, z = table.x, table.y, table.z
    if x is None or y is None or z is None:
        missing = [axis for axis in "xyz" if getattr(table, axis) is None]
        if len(missing) < 3 or table.rotation is not None:
            raise document.error(
                f"[work] gives a place without {', '.join(f'{axis}_mm' for axis in missing)}; "
                "give x_mm, y_mm and z_mm, or none of them",
                "work",
            )
        return None
    return work_placement(x, y, z, table.rotation or 0.0)


def _limits(table: _LimitsTable | None) -> FloatArray | None:
    return None if table is None else np.array([table.x, table.y, table.z])


def _place(inputs: tuple[str, ...]) -> tuple[str, ...]:
    """The table and key of a parameter of `Machine`."""
    for table, kind in (
        ("probe", _ProbeTable),
        ("feeds", _FeedsTable),
        ("distances", _DistancesTable),
        ("work", _WorkTable),
    ):
        keys = _STRUCTURE.keys(kind)
        for name in inputs:
            if name in keys:
                return (table, keys[name])
    return inputs
