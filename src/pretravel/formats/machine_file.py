"""The machine file: what a probing program needs to know of a machine, as TOML."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.controls.machine import Machine, work_placement, work_turn
from pretravel.errors import InputError, PretravelError
from pretravel.frames import Placement
from pretravel.units import DEGREE

_KEYS = {
    "machine": ("name",),
    "probe": (
        "tool",
        "tip_diameter_mm",
        "stem_diameter_mm",
        "stylus_length_mm",
        "body_diameter_mm",
    ),
    "feeds": ("measuring_mm_min", "positioning_mm_min"),
    "distances": ("safe_height_mm", "start_mm", "overtravel_mm", "clearance_mm"),
    "work": ("offset", "x_mm", "y_mm", "z_mm", "rotation_deg"),
    "limits": ("x_mm", "y_mm", "z_mm"),
}

_REQUIRED = {
    "probe": ("tip_diameter_mm", "stem_diameter_mm", "stylus_length_mm", "body_diameter_mm"),
    "feeds": ("measuring_mm_min", "positioning_mm_min"),
    "distances": ("safe_height_mm",),
    "work": ("offset",),
}
"""What moves are made and checked with: never assumed."""

_TEMPLATE = """\
# A machine, for pretravel program: edit, then give it to every program for this machine.

[machine]
name = "{name}"

[probe]
tool = {tool}                  # number in the tool table; 0: it is in the spindle already
tip_diameter_mm = {tip:g}
stem_diameter_mm = {stem:g}      # of the stylus above the tip
stylus_length_mm = {stylus:g}      # from the tip's centre up to the probe's body
body_diameter_mm = {body:g}

[feeds]
measuring_mm_min = {measuring:g}      # while a touch is expected; qualify at this feed too
positioning_mm_min = {positioning:g}  # to where touches start, and back

[distances]
safe_height_mm = {safe:g}        # z (work) of the tip's centre at which it may travel anywhere
start_mm = {start:g}               # from the ball to the surface where a touch starts
overtravel_mm = {overtravel:g}          # beyond the nominal surface before a touch counts as missed
clearance_mm = {clearance:g}           # kept from things on the way: the offset may be off by it

[work]
offset = "{offset}"
{work}
# Of the tip, in machine coordinates; checked where the work offset is told above.
{limits}
"""


def machine_text(machine: Machine) -> str:
    """A machine file, to be edited.

    >>> machine_text(Machine()).splitlines()[3]
    'name = "machine"'
    """
    if machine.work is None:
        work = "# where it is in the machine, to check the limits and turn the map:\n" + "\n".join(
            f"# {line}" for line in _work_lines(Placement())
        )
    else:
        work = "\n".join(_work_lines(machine.work))
    if machine.limits is None:
        limits = "# [limits]\n# x_mm = [-250, 250]\n# y_mm = [-200, 200]\n# z_mm = [-200, 200]"
    else:
        limits = "[limits]\n" + "\n".join(
            f"{axis}_mm = [{low:.10g}, {high:.10g}]"
            for axis, (low, high) in zip("xyz", machine.limits, strict=True)
        )
    return _TEMPLATE.format(
        name=machine.name,
        tool=machine.tool,
        tip=machine.tip_diameter,
        stem=machine.stem_diameter,
        stylus=machine.stylus_length,
        body=machine.body_diameter,
        measuring=machine.measuring_feed,
        positioning=machine.positioning_feed,
        safe=machine.safe_height,
        start=machine.start_distance,
        overtravel=machine.overtravel,
        clearance=machine.clearance,
        offset=machine.work_offset,
        work=work + "\n",
        limits=limits,
    )


def _work_lines(work: Placement) -> list[str]:
    turn = work_turn(work) / DEGREE
    lines = [f"{axis}_mm = {value:.10g}" for axis, value in zip("xyz", work.shift, strict=True)]
    return [*lines, f"rotation_deg = {turn:.10g}"]


def read_machine(path: str | Path) -> Machine:
    r"""A machine from its file.

    Parameters
    ----------
    path : str or Path
        TOML, as `machine_text` writes it.

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
    >>> _ = file.write_text(machine_text(Machine(measuring_feed=30.0)))
    >>> read_machine(file).measuring_feed
    30.0
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(
            "there is no such machine file; pretravel machine > mill.toml writes one to edit",
            path=path,
        ) from None
    except UnicodeDecodeError:
        raise InputError("not a text file, so not a machine file", path=path) from None
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not TOML: {error}", path=path) from None
    for table, values in document.items():
        if table not in _KEYS or not isinstance(values, dict):
            raise InputError(
                f"there is no table [{table}] in a machine file; there are {', '.join(_KEYS)}",
                path=path,
                line=_line(text, table),
            )
        for key in values:
            if key not in _KEYS[table]:
                raise InputError(
                    f"[{table}] has no key '{key}'; it has {', '.join(_KEYS[table])}",
                    path=path,
                    line=_line(text, key, table),
                )

    def value(table: str, key: str, default: Any) -> Any:
        found = document.get(table, {}).get(key, default)
        good = isinstance(found, str) if isinstance(default, str) else _is_number(found)
        if isinstance(default, int) and not isinstance(default, bool):
            good = isinstance(found, int) and not isinstance(found, bool)
        if not good:
            kind = "text" if isinstance(default, str) else "a number"
            raise InputError(
                f"[{table}] {key} = {found!r}: {kind} is needed",
                path=path,
                line=_line(text, key, table),
            )
        return found

    for table, keys in _REQUIRED.items():
        for key in keys:
            if key not in document.get(table, {}):
                raise InputError(
                    f"[{table}] {key} is missing: moves depend on it. pretravel machine prints a "
                    "whole file to edit",
                    path=path,
                    line=_line(text, table),
                )
    usual = Machine()
    given = document.get("work", {})
    work = None
    if any(key in given for key in _KEYS["work"][1:]):
        missing = [key for key in ("x_mm", "y_mm", "z_mm") if key not in given]
        if missing:
            raise InputError(
                f"[work] tells a place without {', '.join(missing)}; give x_mm, y_mm and z_mm, or "
                "none of them",
                path=path,
                line=_line(text, "work"),
            )
        x, y, z = (float(value("work", f"{axis}_mm", 0.0)) for axis in "xyz")
        work = work_placement(x, y, z, float(value("work", "rotation_deg", 0.0)) * DEGREE)
    limits = None
    if "limits" in document:
        pairs = [document["limits"].get(f"{axis}_mm") for axis in "xyz"]
        for axis, pair in zip("xyz", pairs, strict=True):
            if pair is None:
                raise InputError(
                    f"[limits] has no {axis}_mm; all three axes are needed",
                    path=path,
                    line=_line(text, "limits"),
                )
            if not (isinstance(pair, list) and len(pair) == 2 and all(map(_is_number, pair))):
                raise InputError(
                    f"[limits] {axis}_mm = {pair}: two numbers are needed, [lowest, highest]",
                    path=path,
                    line=_line(text, f"{axis}_mm", "limits"),
                )
        limits = np.array(pairs, dtype=np.float64)
    try:
        return Machine(
            name=value("machine", "name", usual.name),
            tool=value("probe", "tool", usual.tool),
            tip_diameter=float(value("probe", "tip_diameter_mm", usual.tip_diameter)),
            stem_diameter=float(value("probe", "stem_diameter_mm", usual.stem_diameter)),
            stylus_length=float(value("probe", "stylus_length_mm", usual.stylus_length)),
            body_diameter=float(value("probe", "body_diameter_mm", usual.body_diameter)),
            measuring_feed=float(value("feeds", "measuring_mm_min", usual.measuring_feed)),
            positioning_feed=float(value("feeds", "positioning_mm_min", usual.positioning_feed)),
            safe_height=float(value("distances", "safe_height_mm", usual.safe_height)),
            start_distance=float(value("distances", "start_mm", usual.start_distance)),
            overtravel=float(value("distances", "overtravel_mm", usual.overtravel)),
            clearance=float(value("distances", "clearance_mm", usual.clearance)),
            work_offset=value("work", "offset", usual.work_offset),
            work=work,
            limits=limits,
        )
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None


def _is_number(value: object) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and bool(np.isfinite(float(value)))
    )


def _line(text: str, key: str, table: str | None = None) -> int | None:
    """The line a key (of a table) or a table's head stands on."""
    here = None
    for number, line in enumerate(text.splitlines(), start=1):
        if head := re.match(r"\s*\[+\s*([^\]]+?)\s*\]", line):
            here = head[1]
            if table is None and here == key:
                return number
        if table is not None and here == table and re.match(rf"\s*{re.escape(key)}\s*=", line):
            return number
    return None
