"""Every file format: what is read and written, and what that was verified against."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from pretravel.errors import InputError, PretravelError
from pretravel.formats.logs.dmis import read_dmis
from pretravel.formats.logs.fusion import read_fusion
from pretravel.formats.logs.grbl import read_grbl_log
from pretravel.formats.logs.joining import FileReadings, Rows, file_lines, join
from pretravel.formats.logs.linuxcnc import read_log_positions, read_probeopen
from pretravel.formats.logs.pretravel_log import read_own_log
from pretravel.formats.logs.qif import read_qif
from pretravel.formats.touches_csv import read_touches
from pretravel.probing.targets import Targets
from pretravel.touches import moved


@dataclass(frozen=True)
class FileFormat:
    """One format of files of touches or points.

    Attributes
    ----------
    name : str
        The word of the command line.
    what : str
    reads, writes : str
        What it is read and written as; empty where it is not.
    needs : str
        What the file does not tell and the user must.
    verified : str
        Against what.
    """

    name: str
    what: str
    reads: str
    writes: str
    needs: str
    verified: str


FORMATS = (
    FileFormat(
        "csv", "CSV with a header (.csv)", "touches, targets", "touches, points, maps", "",
        "round trips",
    ),
    FileFormat(
        "parquet", "Parquet (.parquet)", "touches, targets", "touches, points", "",
        "round trips; pyarrow, which it needs",
    ),
    FileFormat(
        "netcdf", "NetCDF (.nc)", "maps", "maps, points", "", "round trips; xarray",
    ),
    FileFormat(
        "linuxcnc", "log of a program of ours on LinuxCNC", "touches", "the programs", "",
        "LinuxCNC 2.9 (Debian 12), running",
    ),
    FileFormat(
        "probeopen", "LinuxCNC's PROBEOPEN", "positions", "", "units, plan",
        "LinuxCNC 2.9 (Debian 12), running",
    ),
    FileFormat(
        "positions", "lines G1 X… Y… Z…, from LinuxCNC's LOG", "positions", "",
        "plan; units without G20, G21", "LinuxCNC 2.9 (Debian 12), running",
    ),
    FileFormat(
        "grbl", "log of a sender for grbl, grblHAL, FluidNC: [PRB:…]", "positions", "",
        "plan; units without $13; offset without WCO", "public logs of five senders, by their form",
    ),
    FileFormat(
        "fusion", "Fusion inspection results: G800, G801 (.msr, .txt)", "touches",
        "touches, points", "units",
        "public files of a Haas post and of Autodesk's reader, by their form and three points",
    ),
    FileFormat(
        "qif", "QIF 3 MeasuredPointSet (.qif)", "touches, positions", "touches, points",
        "plan without normals",
        "one public file of a CMM, its deviation worked out again; the schema's path to the set, "
        "transcribed (not the whole schema)",
    ),
    FileFormat(
        "dmis", "DMIS: FA(…)=FEAT/POINT,CART,… (.dmo)", "touches", "", "radius taken off",
        "public files of two systems, by their form",
    ),
    FileFormat(
        "print", "print-outs of cycles, Renishaw style: SIZE, POSN", "features (convert to .csv)",
        "", "units", "lines of manuals quoted in public; no file of a machine",
    ),
)  # fmt: skip
"""In the order in which tables show them."""

_SELF_SUFFICIENT = ("csv", "parquet", "linuxcnc", "qif")
_NAMES = tuple(f.name for f in FORMATS)


def format_of(path: str | Path) -> str:
    r"""Which format a file of readings has, by its ending and what is in it.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    str
        Name of a `FileFormat`.

    Raises
    ------
    InputError
        No such file, no text.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "a.txt"
    >>> _ = file.write_text("[PRB:1.0,2.0,3.0:1]\n")
    >>> format_of(file)
    'grbl'
    """
    if Path(path).suffix.lower() == ".parquet":
        return "parquet"
    lines = [line.strip() for line in file_lines(path, "a file of readings") if line.strip()]
    head = lines[0]
    if head.startswith("pretravel-log,"):
        return "linuxcnc"
    if head.startswith(("<?xml", "<")) and any("QIFDocument" in line for line in lines[:50]):
        return "qif"
    if any(re.match(r"G80[01]\s*N", line, re.I) for line in lines):
        return "fusion"
    if any("[PRB:" in line for line in lines):
        return "grbl"
    if any(re.match(r"FA?\s*\(.*\)\s*=\s*FEAT\s*/", line, re.I) for line in lines):
        return "dmis"
    if any(re.search(r"\bACTUAL\b.*\bDEV\b", line, re.I) for line in lines):
        return "print"
    if any(line.startswith("touch,") and line.endswith(",end") for line in lines):
        return "linuxcnc"  # one that has lost its first line
    if re.fullmatch(r"[-+.,\deE\s]+", head) and len(head.split()) >= 3:
        return "probeopen"
    number = r"[-+.\d]"
    positions = re.compile(
        rf"(?:N\d+\s*)?(?:G0?[01]\s*)?X\s*{number}.*Y\s*{number}.*Z\s*{number}", re.I
    )
    if "nx" not in head.split(",") and any(positions.match(line) for line in lines[:20]):
        return "positions"
    return "csv"


def read_readings(
    path: str | Path,
    file_format: str | None = None,
    *,
    plan: Targets | None = None,
    units: str | None = None,
    tip_radius: float | None = None,
    overtravel: float | None = None,
    offset: tuple[float, float, float] | None = None,
    taken_off: float | None = None,
    rotation: float | None = None,
) -> FileReadings:
    """Touches from a file of any format, with what else it tells.

    Parameters
    ----------
    path : str or Path
    file_format : str, optional
        Name of a `FileFormat`; found out when not given.
    plan : Targets, optional
        That was run, for files that tell positions alone.
    units : str, optional
        mm or inch, for files that do not tell.
    tip_radius, overtravel : float, optional
        To join positions with the plan. [mm]
    offset : (3,) float, optional
        Of the work coordinates, for logs in machine coordinates. [mm]
    taken_off : float, optional
        Radius that points of a DMIS file have had taken off. [mm]
    rotation : float, optional
        Of the work coordinates about the machine's z, for files of positions. [rad]

    Returns
    -------
    FileReadings

    Raises
    ------
    InputError
        What the reader of the format says; positions alone and no plan; features, not touches.
    PretravelError
        An unknown format.
    """
    kind = file_format or format_of(path)
    if kind not in _NAMES:
        raise PretravelError(f"format '{kind}' is not known; there are {', '.join(_NAMES)}")
    found: FileReadings | Rows
    if kind in ("csv", "parquet"):
        found = FileReadings(read_touches(path))
    elif kind == "linuxcnc":
        found = read_own_log(path)
    elif kind == "probeopen":
        found = read_probeopen(path, units)
    elif kind == "positions":
        found = read_log_positions(path, units)
    elif kind == "grbl":
        found = read_grbl_log(path, units, offset)
    elif kind == "fusion":
        found = read_fusion(path, units)
    elif kind == "qif":
        found = read_qif(path)
    elif kind == "dmis":
        found = read_dmis(path, taken_off, units)
    elif kind == "print":
        raise InputError(
            "a print-out holds sizes and positions of features, with the radii taken off: "
            "there are no touches in it to compensate. pretravel convert makes a table of it",
            path=path,
        )
    else:
        raise InputError(f"{kind} files hold no readings", path=path)
    if isinstance(found, FileReadings):
        return found
    if plan is None:
        raise InputError(
            "it tells positions, but not what was to be touched there; give the plan that was run "
            "(pretravel convert … --plan plan.csv --tip-diameter …)",
            path=path,
        )
    if tip_radius is None:
        raise InputError(
            "to join its positions with the plan the tip's diameter is needed (--tip-diameter)",
            path=path,
        )
    joined = join(found, plan, tip_radius, overtravel=overtravel)
    if rotation is not None:
        return replace(joined, rotation=rotation)
    told = (
        "the file does not tell how the work coordinates were turned in the machine (G10 L2 R): "
        "taken as not turned; a machine file with [work] tells it (--machine)"
    )
    return replace(joined, warnings=(*joined.warnings, told))


def read_touches_of(path: str | Path, *, machine_axes: bool) -> FileReadings:
    """Touches of a file that tells all by itself: CSV, Parquet, QIF, a log of our programs.

    Parameters
    ----------
    path : str or Path
    machine_axes : bool
        Turn them out of turned work coordinates, as qualifying needs it.

    Returns
    -------
    FileReadings

    Raises
    ------
    InputError
        As the formats' readers; files that need more to be told: `pretravel convert` takes it.
    """
    kind = format_of(path)
    if kind not in (*_SELF_SUFFICIENT, "print"):
        needs = next(entry.needs for entry in FORMATS if entry.name == kind)
        raise InputError(
            f"a file of format {kind} does not tell all that is needed"
            + (f" ({needs})" if needs else "")
            + "; pretravel convert makes touches of it, and says what it wants to know",
            path=path,
        )
    found = read_readings(path, kind)
    if machine_axes and found.rotation:
        found = replace(found, touches=moved(found.touches, found.placement), rotation=0.0)
    return found
