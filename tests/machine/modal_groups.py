"""The modal groups of LinuxCNC, and what programs and cycles do with each; the page has the table.

`python -m tests.machine.modal_groups` writes it. Names are those of the control's own header,
interp_internal.hh; M groups have none there, and are numbered as in its manual.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).parent.parent.parent / "docs" / "how-to" / "linuxcnc-faults.md"
HEADER = Path("/usr/include/linuxcnc/interp_internal.hh")
_LINE = "| group | words | what programs and cycles do |\n| --- | --- | --- |"
BACK = "set by the program, and restored after a stop"


@dataclass(frozen=True)
class ModalGroup:
    """A group, its words, and what our programs and cycles do with it."""

    name: str
    words: str
    done: str


GROUPS = (
    ModalGroup("GM_MODAL_0", "G4 G10 G28 G30 G52 G53 G92", "not modal; G92 see below"),
    ModalGroup(
        "GM_MOTION",
        "G0 G1 G2 G3 G33 G38.n G73 G76 G80 to G89",
        "set by each move, and not restored: write G0 or G1 in your next block",
    ),
    ModalGroup(
        "GM_SET_PLANE", "G17 G18 G19 G17.1 G18.1 G19.1", f"{BACK}; a normal end (M2) selects G17"
    ),
    ModalGroup(
        "GM_DISTANCE_MODE",
        "G90 G91",
        f"{BACK}; a normal end (M2) selects G90; cycles stop if it is G91",
    ),
    ModalGroup("GM_IJK_DISTANCE_MODE", "G90.1 G91.1", "no effect: no arcs"),
    ModalGroup(
        "GM_FEED_MODE",
        "G93 G94 G95, with F",
        f"{BACK}, F too; a normal end (M2) selects G94; cycles stop if it is not G94",
    ),
    ModalGroup("GM_LENGTH_UNITS", "G20 G21", "set by programs, used by cycles, and restored"),
    ModalGroup(
        "GM_CUTTER_COMP",
        "G40 G41 G42 G41.1 G42.1",
        "checked: programs and cycles stop if one is active",
    ),
    ModalGroup(
        "GM_TOOL_LENGTH_OFFSET",
        "G43 G43.1 G43.2 G49",
        "checked against the probe, and restored",
    ),
    ModalGroup("GM_RETRACT_MODE", "G98 G99", "no effect: no canned cycles"),
    ModalGroup(
        "GM_COORD_SYSTEM",
        "G54 to G59.3",
        "set by programs, used by cycles, and restored after a stop, on the screens too; a "
        "normal end (M2) selects G54",
    ),
    ModalGroup(
        "GM_CONTROL_MODE",
        "G61 G61.1 G64",
        "not changed: the stopping distance is that of G64, with half of the acceleration",
    ),
    ModalGroup("GM_SPINDLE_MODE", "G96 G97", "no effect: the spindle is stopped"),
    ModalGroup(
        "GM_LATHE_DIAMETER_MODE",
        "G7 G8",
        "checked: programs and cycles stop if G7 is active, which halves X",
    ),
    ModalGroup(
        "GM_G92_IS_APPLIED",
        "G92 G92.1 G92.2 G92.3",
        "programs stop if one is active and the machine file has no place of the work offset; in "
        "cycles it is part of the work coordinates",
    ),
    ModalGroup("M group 4", "M0 M1 M2 M30 M60", "a program ends with M2"),
    ModalGroup(
        "M group 7",
        "M3 M4 M5 M19",
        "programs stop the spindle, before each move too; cycles stop if it turns",
    ),
    ModalGroup("M group 6", "M6", "the tool in the spindle is checked"),
    ModalGroup("M group 8", "M7 M8 M9", "programs switch coolant off, and it stays off"),
    ModalGroup(
        "M group 9",
        "M48 M49 M50 M51 M52 M53",
        "feed override and adaptive feed are off during a touch, and restored; a feed stop (M53) "
        "can interrupt a touch, which then continues",
    ),
    ModalGroup("M group 10", "M100 to M199", "not used"),
)


def groups_of_the_control() -> set[str]:
    """Names of the modal groups in the header of the installed control."""
    body = HEADER.read_text().partition("enum ModalGroups")[2].partition("}")[0]
    return set(re.findall(r"\b(GM_\w+) =", body))


def rows() -> list[str]:
    """The rows of the table."""
    return [f"| `{group.name}` | {group.words} | {group.done} |" for group in GROUPS]


def main() -> None:
    """Write the table of the page."""
    head, _, rest = PAGE.read_text(encoding="utf-8").partition(_LINE)
    _, blank, tail = rest.partition("\n\n")
    PAGE.write_text(head + "\n".join([_LINE, *rows()]) + blank + tail, encoding="utf-8")


if __name__ == "__main__":
    main()
