"""The scatter of single touches by direction, from the file of a separation."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, FloatArray, InputError, PretravelError, parsed_json
from pretravel.files.comments_of_tables import telling_comments
from pretravel.files.csv_table import read_csv_table
from pretravel.files.source_file import opened, shortened
from pretravel.measurement import TouchScatter

_COLUMNS = (
    "kind", "index", "systematic_um", "u_systematic_um", "variance_um2", "u_variance_um2",
    "azimuth_deg",
)  # fmt: skip


def read_touch_scatter(path: str | Path) -> TouchScatter:
    """Read the variances of a separation of machine and probe, by direction.

    Parameters
    ----------
    path : str or Path
        What `separate` writes: .csv, or .json with all values.

    Raises
    ------
    InputError
        A file of something else; directions whose azimuths are not known; negative variances.
    """
    path = Path(path)
    columns = _directions_of_result(path) if path.suffix.lower() == ".json" else None
    if columns is None:
        table = read_csv_table(path)
        for number, line in telling_comments(table.comments):
            raise InputError(
                f"'{shortened(line)}' is not read: what separate writes has no comments. Take it "
                "away if the columns are what their names say",
                path=path,
                line=number,
            )
        needed = ("kind", "variance_um2", "azimuth_deg")
        table.require(*needed, what="a separation of machine and probe")
        table.refuse_others(*_COLUMNS, what="a separation of machine and probe")
        columns = {
            name: list(table.columns[name])
            for name in (*needed, "systematic_um")
            if name in table.columns
        }
    kinds = np.array([str(kind).strip() for kind in columns["kind"]])
    if others := {*kinds.tolist()} - {"machine", "probe"}:
        raise InputError(f"kind is '{shortened(min(others))}'; it is machine or probe", path=path)
    try:
        values = {
            name: np.array([_number_or_nan(cell) for cell in columns[name]])
            for name in ("azimuth_deg", "variance_um2")
        }
        azimuth, variance = values["azimuth_deg"] * DEGREE, values["variance_um2"] * MICROMETRE**2
        error = [_number_or_nan(cell) for cell in columns.get("systematic_um", ())]
        own = np.array(error)[kinds == "machine"] * MICROMETRE if error else np.zeros(0)
        of_machine, of_probe = kinds == "machine", kinds == "probe"
        _refuse_other_units(path, kinds, values["azimuth_deg"], values["variance_um2"])
        _refuse_gaps(path, kinds, np.round(np.mod(values["azimuth_deg"], 360.0), 6), own)
        return TouchScatter(
            azimuth[of_machine],
            variance[of_machine],
            azimuth[of_probe],
            variance[of_probe],
            machine_error=own if np.all(np.isfinite(own)) else np.zeros(0),
        )
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    except (TypeError, ValueError) as error:
        raise InputError(f"a variance or azimuth is not a number ({error})", path=path) from None


_SMALLEST = 1e-5
"""Mean variance of a pair: a touch scatters by more than 3 nm. [µm²]"""


def _refuse_other_units(
    path: Path, kinds: npt.NDArray[np.str_], azimuth: FloatArray, variance: FloatArray
) -> None:
    """Refuse azimuths [°] and variances [µm²] that only another unit explains."""
    pair = 0.0
    for kind in ("machine", "probe"):
        own = np.sort(np.mod(azimuth[kinds == kind], 360.0))
        if len(own) > 1 and np.all(np.isfinite(own)):
            widest = float(np.max(np.diff(own, append=own[0] + 360.0)))
            if widest > 180.0:
                raise InputError(
                    f"the directions of the {kind} lie within {360.0 - widest:.3g}°: is "
                    "azimuth_deg in degrees?",
                    path=path,
                )
        pair += float(np.mean(variance[kinds == kind])) if len(own) else math.nan
    if 0.0 <= pair < _SMALLEST:
        raise InputError(
            f"machine and probe have a variance of {pair:.2g} µm² together, less than any touch: "
            "is variance_um2 in µm²?",
            path=path,
        )


def _refuse_gaps(
    path: Path, kinds: npt.NDArray[np.str_], azimuth: FloatArray, errors: FloatArray
) -> None:
    """Refuse directions that are there twice, and errors of the machine that only some have."""
    places: set[tuple[str, float]] = set()
    for kind, angle in zip(kinds.tolist(), azimuth.tolist(), strict=True):
        if (kind, angle) in places:
            raise InputError(
                f"{kind} has azimuth_deg {angle:g} twice: leave one row out", path=path
            )
        places.add((kind, angle))
    known = np.isfinite(errors)
    if known.any() and not known.all():
        raise InputError(
            "systematic_um of the machine is empty in some rows: fill it in, or leave it out in "
            "all",
            path=path,
        )


def _number_or_nan(cell: object) -> float:
    """A number of a table; nan for an empty cell and for the null of JSON."""
    return math.nan if cell is None or not str(cell).strip() else float(str(cell))


def _directions_of_result(path: Path) -> dict[str, list[object]]:
    """The columns of the table of directions in a result with all values."""
    hint = "it is not a result of separate with all values (separate … -o separation.json)"
    try:
        content = parsed_json(opened(path).content)
        tables = content["document"]["data"]
        (directions,) = [table for table in tables if table["title"] == "Directions"]
        columns = {column["name"]: list(column["values"]) for column in directions["columns"]}
        needed = ("kind", "variance_um2", "azimuth_deg")
        if len({len(columns[name]) for name in needed}) > 1:
            raise InputError(hint, path=path)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, PretravelError):
        raise InputError(hint, path=path) from None
    return columns
