"""Limits of fits: ISO 286-1, classes D to H, JS, K, M, N, P, R and S of holes, d to s of shafts."""

from __future__ import annotations

import re
from bisect import bisect_left

_ENDS = (3.0, 6.0, 10.0, 18.0, 30.0, 50.0, 80.0, 120.0, 180.0, 250.0, 315.0, 400.0, 500.0)
"""Largest nominal size of each range. [mm]"""
_GRADES = {
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    12: (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
    13: (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
    14: (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550),
}
"""Widths by grade: ISO 286-1:2010, table 1. [µm]"""
_DISTANCES = {
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}
"""Of the nearer limit from the nominal size: ISO 286-1:2010, tables 2 and 4. [µm]"""
_BEYOND = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
"""The same of classes whose shafts are larger than the nominal size: tables 3 and 5. [µm]"""
_NARROW_ENDS = (3.0, 6.0, 10.0, 18.0, 30.0, 50.0, 65.0, 80.0, 100.0, 120.0, 140.0, 160.0, 180.0,
                200.0, 225.0, 250.0, 280.0, 315.0, 355.0, 400.0, 450.0, 500.0)  # fmt: skip
_NARROW = {
    "r": (10, 15, 19, 23, 28, 34, 41, 43, 51, 54, 63, 65, 68, 77, 80, 84, 94, 98, 108, 114, 126,
          132),
    "s": (14, 19, 23, 28, 35, 43, 53, 59, 71, 79, 92, 100, 108, 122, 130, 140, 158, 170, 190, 208,
          232, 252),
}  # fmt: skip
"""The same of classes whose ranges are narrower from 50 mm on: table 5. [µm]"""
_K_GRADES = (4, 5, 6, 7)
"""Grades in which k is larger than the nominal size; in others its lower limit is zero."""
_CLASS = re.compile(r"([A-Za-z]{1,2})\s*(\d{1,2})")


def class_of_fit(form: str, zone: str, grade: str) -> str:
    """The class that the three attributes of LIMITS_AND_FITS state, in the ways of CAD programs.

    >>> class_of_fit("H", "hole", "7"), class_of_fit("", "g", "IT6"), class_of_fit("H7", "", "")
    ('H7', 'g6', 'H7')
    >>> class_of_fit("h", "hole", "7"), class_of_fit("G", "shaft", "6")
    ('H7', 'g6')
    """
    number = grade.strip().upper().removeprefix("IT").strip()
    of = zone.strip().lower()
    plain = form.strip(), ("" if of in ("hole", "shaft") else zone.strip())
    for fit in (word for letters in plain if letters for word in (letters, f"{letters}{number}")):
        if _CLASS.fullmatch(fit):
            return {"hole": fit.upper(), "shaft": fit.lower()}.get(of, fit)
    return f"{form.strip()}{number}"


def limits_of_fit(nominal: float, fit: str) -> tuple[float, float] | None:
    """The limits of a size by its class.

    Parameters
    ----------
    nominal : float
        [mm]
    fit : str
        ``H7``, ``g6``, ``js9``.

    Returns
    -------
    pair of float or None
        [mm] None: a class that is not in these tables.

    >>> limits_of_fit(25.0, "H7"), limits_of_fit(20.0, "g6"), limits_of_fit(10.0, "zc6")
    ((25.0, 25.021), (19.98, 19.993), None)
    >>> limits_of_fit(25.0, "k6"), limits_of_fit(25.0, "K7"), limits_of_fit(25.0, "P7")
    ((25.002, 25.015), (24.985, 25.006), (24.965, 24.986))
    """
    found = _CLASS.fullmatch(fit)
    if found is None or not 0.0 < nominal <= _ENDS[-1]:
        return None
    letter, grade = found[1], int(found[2])
    row = bisect_left(_ENDS, nominal)
    if grade not in _GRADES or (letter != letter.upper() and letter != letter.lower()):
        return None
    width = _GRADES[grade][row]
    if letter.lower() == "js":
        low, high = -0.5 * width, 0.5 * width
    elif letter.lower() in _DISTANCES:
        away = _DISTANCES[letter.lower()][row]
        low, high = (away, away + width) if letter.isupper() else (-away - width, -away)
    elif (lower := _lower_of_shaft(letter.lower(), nominal)) is None:
        return None
    elif letter.islower():
        low = 0.0 if letter == "k" and grade not in _K_GRADES else lower
        high = low + width
    else:
        upper = _upper_of_hole(letter, grade, row, lower)
        if upper is None:
            return None
        low, high = upper - width, upper
    return round(nominal + 1e-3 * low, 9), round(nominal + 1e-3 * high, 9)


def _lower_of_shaft(letter: str, nominal: float) -> float | None:
    """The lower deviation of shafts k to s; None: no such class. [µm]"""
    if letter in _BEYOND:
        return _BEYOND[letter][bisect_left(_ENDS, nominal)]
    found = _NARROW.get(letter)
    return None if found is None else found[bisect_left(_NARROW_ENDS, nominal)]


def _upper_of_hole(letter: str, grade: int, row: int, lower: float) -> float | None:
    """The upper deviation of holes K to S: that of the shaft, less the step between the grades.

    Up to 3 mm and in wider grades without the step (ISO 286-1:2010, table 3); N then ends at the
    nominal size. None: a grade in which the standard has no such class. [µm]
    """
    wide = grade > (7 if letter in "PRS" else 8)
    if row == 0 or (wide and letter in "MPRS"):
        return -lower
    if wide:
        return 0.0 if letter == "N" else None
    if grade - 1 not in _GRADES:
        return None
    if (letter, grade, row) == ("M", 6, _ENDS.index(315.0)):
        return -9.0  # table 3 has it as an exception to the rule
    step = _GRADES[grade][row] - _GRADES[grade - 1][row]
    return float(step - lower)
