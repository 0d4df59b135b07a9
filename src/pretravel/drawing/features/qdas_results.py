"""Measured features as a Q-DAS file (.dfq), the ASCII transfer format of statistics programs.

The format is public as ISO/TR 11462-5, which was not at hand: the keys here are those that public
files have, and an independent reader confirms them (``findings/qdas_reader_and_dates.sh``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pretravel.base import PretravelError, write_text

_OF_A_VALUE, _OF_A_CHARACTERISTIC = "\x14", "\x0f"
"""What separates the fields of a value, and the characteristics of a line of values."""
_VALID = "0"
"""The attribute of a value that holds."""
_VARIABLE = "0"
"""The kind of a characteristic that is measured, not counted."""
_DECIMALS = 5
_ENCODING = "cp1252"


def write_qdas_results(
    path: str | Path,
    rows: Sequence[Mapping[str, Any]],
    *,
    part: str,
    nominals: Mapping[tuple[str, str], float] | None = None,
) -> None:
    """Write quantities as the characteristics of one part, with one value each.

    Parameters
    ----------
    path : str or Path
    rows : sequence of mapping
        As of `pretravel.drawing.features.feature_results.result_rows`.
    part : str
        Its number or name.
    nominals : mapping of (feature, quantity) to float, optional
        Nominal values, in mm or degrees.

    Raises
    ------
    PretravelError
        A name with a sign that the format cannot carry.

    Notes
    -----
    The format has a value and its limits, and no place for an uncertainty: a program that compares
    them decides without it. A value has no date, since that of the measurement is not known.
    """
    nominals = nominals or {}
    lines = [f"K0100 {len(rows)}", f"K1001 {_text(part)}"]
    values = []
    for number, row in enumerate(rows, start=1):
        name = _text(" ".join(filter(None, (row["feature"], row["quantity"]))))
        fields = {
            "K2001": str(number),
            "K2002": name,
            "K2004": _VARIABLE,
            "K2022": str(_DECIMALS),
            "K2101": _number(nominals.get((row["feature"], row["quantity"]))),
            "K2110": _number(row["lower"]),
            "K2111": _number(row["upper"]),
            "K2142": row["unit"],
        }
        lines += [f"{key}/{number} {value}" for key, value in fields.items() if value]
        values.append(f"{_number(row['value'])}{_OF_A_VALUE}{_VALID}")
    lines.append(_OF_A_CHARACTERISTIC.join(values))
    write_text(path, "".join(f"{line}\r\n" for line in lines), encoding=_ENCODING)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.9f}"


def _text(text: str) -> str:
    text = " ".join(text.split())
    try:
        text.encode(_ENCODING)
    except UnicodeEncodeError as error:
        raise PretravelError(
            f"'{text}': a Q-DAS file cannot carry '{text[error.start]}'; use another name, or "
            "write the results as .qif or .csv",
            inputs=("output",),
        ) from None
    if not text.isprintable():
        raise PretravelError(
            f"{text!r}: a Q-DAS file cannot carry control characters; use another name",
            inputs=("output",),
        )
    return text
