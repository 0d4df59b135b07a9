"""Whether a map is used on the touches that made it: the map keeps a short digest of each.

On its own touches a map looks better than it is, because it follows a part of their scatter.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, StaleTouchesError
from pretravel.maps import Origin, PretravelMap, TabulatedBasis
from pretravel.touches import Touches, quantisation_step

_DIGITS = 12
"""Hexadecimal digits of a digest: two of a million touches are alike with a chance of 0.2 %."""
_MOST_KEPT = 1000
"""Of more touches those with the smallest digests are kept: of any other touches, the share that
is found among them is the share that made the map."""
_RESOLUTION = 1e-9  # mm; of coordinates that a file states to the last digit
_ALL = 0.9
"""Share of touches from which a map is said to be used on its own touches."""
_DEVIATIONS = 4.0
"""Standard deviations by which the number of touches that are alike exceeds chance."""


def touch_digests(positions: npt.ArrayLike, earlier: str = "") -> str:
    """Digests of touches, as a text that a map keeps.

    Parameters
    ----------
    positions : (n, 3) float
        As the machine latched them. [mm]
    earlier : str
        Digests of further touches, to keep too.

    Returns
    -------
    str
        12 hexadecimal digits for each touch, in ascending order.

    >>> touch_digests([[0.0, 0.0, 3.0]]) == touch_digests([[0.0, -0.0, 3.0], [0.0, 0.0, 3.0]])
    True
    """
    found = np.union1d(_digests(np.asarray(positions, dtype=np.float64)), _numbers(earlier))
    return "".join(f"{number:0{_DIGITS}x}" for number in found[:_MOST_KEPT].tolist())


def touches_that_made(touches: Touches, digests: str) -> tuple[int, int]:
    """How many touches have exactly the position of a touch of the digests.

    Parameters
    ----------
    touches : Touches
    digests : str
        From `touch_digests`.

    Returns
    -------
    found, compared : int
        Fewer than all are compared where the digests are those of a part of the touches.

    >>> touches = Touches([[0.0, 0.0, 3.0], [0.0, 0.0, 3.1]], [[0.0, 0.0, 1.0]] * 2)
    >>> touches_that_made(touches, touch_digests(touches.positions[:1]))
    (1, 2)
    """
    known = _numbers(digests)
    mine = _digests(touches.positions)
    if len(known) >= _MOST_KEPT:
        mine = mine[mine <= known[-1]]
    return int(np.isin(mine, known).sum()), len(mine)


def own_touches_warnings(
    touches: Touches, pretravel_map: PretravelMap, consequence: str
) -> list[str]:
    """A warning where a map is used on touches that made it.

    Parameters
    ----------
    touches : Touches
    pretravel_map : PretravelMap
    consequence : str
        What that does to the result, and what to do.

    Returns
    -------
    list of str
        Empty, or one sentence. Maps of earlier versions keep the name of the file alone.

    Notes
    -----
    Where a control latches in coarse steps, a touch can repeat an earlier one by chance, with a
    probability of about q / (2 √π σ) for each earlier one of its direction, with steps q and a
    repeatability σ. Some touches alone are named where they are more than chance explains.
    """
    made = pretravel_map.provenance
    if not made.touch_digests:
        if touches.source and touches.source == made.touches_file:
            name = touches.source
            return [f"the map was made from touches of a file of this name, {name}: {consequence}"]
        return []
    found, compared = touches_that_made(touches, made.touch_digests)
    if found <= _by_chance(touches.positions, pretravel_map, compared):
        return []
    return [f"{_words(found, compared, len(touches))}: {consequence}"]


def refuse_own_touches(touches: Touches, pretravel_map: PretravelMap) -> None:
    """Refuse to verify a map with the touches that made it: nothing would be tested.

    Raises
    ------
    StaleTouchesError
        Nearly all touches are touches of the map.
    """
    found, compared = touches_that_made(touches, pretravel_map.provenance.touch_digests)
    if found > _ALL * compared:
        raise StaleTouchesError(
            f"nothing was tested: {_words(found, compared, len(touches))}. A map always agrees "
            "with its own touches. Touch the reference again"
        )


def _words(found: int, compared: int, given: int) -> str:
    part = "" if compared == given else " that were compared"
    which = f"{found} of {compared} touches{part}"
    if found == compared == given:
        which = f"all {found} touches"
    return f"{which} are identical to touches that the map was made from"


def _by_chance(positions: FloatArray, pretravel_map: PretravelMap, compared: int) -> float:
    """The most touches that are alike by chance; fewer than nearly all of them."""
    step = quantisation_step(positions)
    if step == 0.0:
        return 0.0
    known = _numbers(pretravel_map.provenance.touch_digests)
    made = float(len(known))
    if len(known) >= _MOST_KEPT:  # the smallest of all: their number follows from the largest kept
        made *= 16.0**_DIGITS / max(float(known[-1]), 1.0)
    repeats = max(made / len(pretravel_map.support.nodes), 1.0)
    one = step / (2.0 * math.sqrt(math.pi) * max(pretravel_map.repeatability, 1e-9))
    chance = min(repeats * one, 1.0)
    spread = math.sqrt(compared * chance * (1.0 - chance))
    return min(compared * chance + _DEVIATIONS * spread, _ALL * compared)


def _digests(positions: FloatArray) -> npt.NDArray[np.uint64]:
    """A number for each position, of 48 bits.

    The mixing function is that of SplitMix64 (Steele, Lea, Flood 2014).
    """
    steps = np.rint(positions / _RESOLUTION).astype(np.int64).astype(np.uint64)
    mixed = np.zeros(len(positions), dtype=np.uint64)
    for axis in range(3):
        mixed = mixed + steps[:, axis] + np.uint64(0x9E3779B97F4A7C15)
        mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        mixed = mixed ^ (mixed >> np.uint64(31))
    return np.asarray(mixed >> np.uint64(64 - 4 * _DIGITS))


def _numbers(digests: str) -> npt.NDArray[np.uint64]:
    """The numbers of a text of digests; a text that is none contains none."""
    try:
        parts = [digests[i : i + _DIGITS] for i in range(0, len(digests), _DIGITS)]
        return np.array(sorted(int(part, 16) for part in parts), dtype=np.uint64)
    except (ValueError, OverflowError):
        return np.empty(0, dtype=np.uint64)


def refuse_table(pretravel_map: PretravelMap) -> None:
    """Refuse a qualified map of which only a table is left, as qualify writes it into .csv.

    Touches of the map could verify it, errors of the reference look like a change of the probe, and
    an update would fit the thousands of values of the table.

    Raises
    ------
    PretravelError
    """
    made = pretravel_map.provenance
    table = pretravel_map.kind == TabulatedBasis.kind and made.origin is Origin.QUALIFIED
    if table and made.setup is None:
        raise PretravelError(
            "this map is a table (.csv): neither the reference nor the touches of its "
            "qualification are in it. Use the map of pretravel qualify, .json"
        )
