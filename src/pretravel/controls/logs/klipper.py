"""Console output of Klipper: ``probe at X,Y is z=Z`` of PROBE, PROBE_ACCURACY, meshes; reading."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from pretravel.controls.logs.heights_of_log import TERMINAL, TERMINAL_LINES, LoggedHeights
from pretravel.files import FileFormat, FileReadings, Source, opened

_BEFORE = r"\bprobe:?(?: result)? at "
_BETWEEN = r" (?:is|bed will contact at) z="
_TOUCH = re.compile(rf"{_BEFORE}(-?[\d.]+), ?(-?[\d.]+){_BETWEEN}(-?[\d.]+)(?![\d._])")
_TOUCH_BEGINS = re.compile(rf"{_BEFORE}-?[\d.]+, ?-?[\d.]+{_BETWEEN}")
_RESULT = re.compile(
    r"\bResult: at (-?[\d.]+), ?(-?[\d.]+) estimate contact at z=(-?[\d.]+)(?![\d._])"
)
"""What PROBE makes of its samples; where the log has no line of a sample, a touch."""
_NOT_WHOLE = re.compile(rf"{_BEFORE}-?[\d.]+[,_]")
_SERIES_BEGINS = re.compile(r"\bPROBE_ACCURACY at X:")
_SERIES_ENDS = "probe accuracy results:"
_CONTACT = "bed will contact at"
"""Later versions: where the probe meets the bed. `is z=` is where the toolhead was then."""
_DISCARDED = "[discarded]"
_REJECTED = re.compile(r"\bprobe samples exceed (?:samples_)?tolerance", re.IGNORECASE)


def read_klipper_log(source: Source) -> FileReadings:
    r"""Read the touches of Klipper's console output, as terminals and klippy.log keep it.

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    FileReadings
        In mm, with normals along z. Labels: accuracy 1/1, accuracy 1/2 … of each PROBE_ACCURACY,
        probe/1 … of the others.

    Raises
    ------
    InputError
        No touches; a line that is cut off; lines of two versions. The message contains the line.

    >>> from pretravel.files.source_file import SourceFile
    >>> text = b"Recv: // probe at 97.000,2.000 is z=1.3200\n// probe at 97.000,2.000 is z=1.3175\n"
    >>> read_klipper_log(SourceFile("octoprint.log", text)).touches.positions[1].tolist()
    [97.0, 2.0, 1.3175]
    """
    file = opened(source)
    found = LoggedHeights(file, statements=TERMINAL_LINES)
    name = "probe"
    discarded: list[int] = []
    rejected: list[int] = []
    of_contact: bool | None = None
    results: list[tuple[Sequence[str], int]] = []
    for number, line in enumerate(file.lines("console output of Klipper"), start=1):
        if _SERIES_BEGINS.search(line):
            name = found.new_series("accuracy")
        elif _SERIES_ENDS in line:
            name = "probe"
        elif touch := _TOUCH.search(line):
            if _DISCARDED in line:
                discarded.append(number)
                continue
            if of_contact not in (None, _CONTACT in line):
                raise file.error(
                    f"'{_CONTACT} z=' states where the probe meets the bed, and 'is z=' where the "
                    "toolhead was: they differ by the offsets of the probe. Put the "
                    "lines of each version of Klipper into a file of its own",
                    number,
                )
            of_contact = _CONTACT in line
            found.take(name, touch.groups(), number)
        elif _REJECTED.search(line):
            rejected.append(number)
        elif result := _RESULT.search(line):
            results.append((result.groups(), number))
        elif _TOUCH_BEGINS.search(line) or _NOT_WHOLE.search(line):
            raise file.error("the line is cut off: probe at X,Y is z=Z is needed", number)
        else:
            found.read_statement(line, number)
    if not found.positions:
        for cells, number in results:
            found.take("result", cells, number)
        rejected = []
    readings = found.readings("the file contains no touch (probe at X,Y is z=Z)")
    told = _told(discarded, rejected)
    if "result/1" in (readings.touches.labels or ()):
        told.append("each height is a result of PROBE, which can be that of several samples")
    return replace(readings, warnings=(*readings.warnings, *told))


def _told(discarded: Sequence[int], rejected: Sequence[int]) -> list[str]:
    """What Klipper itself did with touches, as sentences."""
    said = []
    if discarded:
        said.append(
            f"{len(discarded)} first touches that Klipper discarded are left out (line "
            f"{discarded[0]} …)"
        )
    if rejected:
        said.append(
            f"Klipper rejected the touches before line {rejected[0]}"
            + (f" and {len(rejected) - 1} more times" if len(rejected) > 1 else "")
            + ", since they exceed its tolerance, and touched again: all are used"
        )
    return said


KLIPPER = FileFormat(
    name="klipper",
    what="console output of Klipper: probe at X,Y is z=Z, of PROBE_ACCURACY and meshes",
    own_unit="mm",
    reads="touches",
    verified="the syntax of lines in seven public threads and in the source of Klipper",
    self_contained=True,
    recognises=lambda lines: any(_TOUCH_BEGINS.search(li) or _RESULT.search(li) for li in lines),
    parse=lambda file, _: read_klipper_log(file),
    statements=TERMINAL,
    other_lines="named",
)
