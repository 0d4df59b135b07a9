"""Orientation of spindle and head, and the tip, that a map and touches state: one map is of one."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from pretravel.base import DEGREE, FloatArray, PretravelError, probe_rotation
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.touches import Touches

SAME_ORIENTATION = 1.0
"""Orientations closer than this are one: M19 stops within less. [°]"""


def orientation_of(touches: Touches) -> float | None:
    """The one orientation at which touches were made, in degrees; None where it is not stated.

    Raises
    ------
    PretravelError
        Several orientations: a map is that of one. A tip and an orientation of the head that
        contradict each other.

    >>> up = [[0.0, 0.0, 1.0]]
    >>> orientation_of(Touches([[0.0, 0.0, 3.0]], up, spindle=np.array([np.pi])))
    180.0
    """
    _refuse_two_heads(touches)
    if touches.spindle is None:
        return None
    angles = touches.spindle / DEGREE
    first = float(angles[0])
    other = np.flatnonzero(np.abs(_turn(angles - first)) > SAME_ORIENTATION)
    if len(other):
        raise PretravelError(
            f"{touches.where(int(other[0]))} was made at spindle {angles[other[0]]:g}°, the first "
            f"touch at {first:g}°: the lobes of a probe turn with the spindle, and a map is that "
            "of one orientation. Qualify each orientation separately, or average both with "
            "pretravel reversal"
        )
    return round(first, 6)


def one_word(touches: Touches, column: str) -> str:
    """The one word that touches state in a column (tip, orientation); empty where they do not.

    >>> one_word(Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]], tips=("T1A0B0",)), "tip")
    'T1A0B0'
    """
    words = {*touches.words.get(column, ())}
    return words.pop() if len(words) == 1 else ""


_HEAD = re.compile(r"A(-?\d+(?:\.\d+)?)[ _/]?B(-?\d+(?:\.\d+)?)", re.IGNORECASE)
"""Angles of an indexing head in the name of a tip, as in T1A90B0."""
_TOOL = re.compile(r"^(?:t|tool|tip|stylus|probe|werkzeug|taster)?[\s_#:.-]*+0*+(?=\d)")
"""Before the number of a tip: T05 is 5."""
_TILTED = 5.0
"""A head that is tilted by less holds the probe along z. [deg]"""
_ANGLES = re.compile(r"-?\d+(?:\.\d+)?")


def _head(tip: str, orientation: str) -> tuple[float, ...] | str:
    """Angles of the head, or its orientation by name; empty where neither is stated."""
    own = orientation[: -len(REVERSAL)].strip() if is_reversal(orientation) else orientation
    found = _HEAD.search(own or tip)
    angles = found.groups() if found else _ANGLES.findall(own)
    return tuple(map(float, angles)) or own.strip().casefold()


def _refuse_two_heads(touches: Touches) -> None:
    """Refuse a touch whose tip gives the head other angles than its orientation."""
    words = touches.words
    for tip, orientation in dict.fromkeys(
        zip(words.get("tip", ()), words.get("orientation", ()), strict=False)
    ):
        one, other = _HEAD.search(tip), _HEAD.search(orientation)
        if one and other and tuple(map(float, one.groups())) != tuple(map(float, other.groups())):
            raise PretravelError(
                f"the tip is {tip}, and the orientation {orientation}: they give the head other "
                "angles. Correct the one that is wrong, or leave its column out",
                inputs=("columns",),
            )


def axis_note(pretravel_map: PretravelMap) -> str:
    """A sentence where the head was tilted, as a name gives it, and the probe axis is along z."""
    made = pretravel_map.provenance
    found = _HEAD.search(made.orientation or made.tip)
    tilt = abs((float(found[1]) + 180.0) % 360.0 - 180.0) if found else 0.0
    if tilt <= _TILTED or pretravel_map.rotation[2, 2] < 1.0:
        return ""
    return (
        f"{made.orientation or made.tip} says that the head was tilted by {tilt:g}°, and the probe "
        "axis is along z: give the axis of the probe as the head holds it"
    )


def _refuse_other_tip(touches: Touches, pretravel_map: PretravelMap) -> None:
    """Refuse touches of a tip of another name than that of the map, apart from angles of a head."""
    mine, other = one_word(touches, "tip"), pretravel_map.provenance.tip
    names = [_TOOL.sub("", _HEAD.sub("", tip).strip().casefold()) for tip in (mine, other)]
    if mine and other and names[0] != names[1]:
        raise PretravelError(
            f"the touches are of tip {mine}, the map is of tip {other}: another stylus has another "
            "pretravel. Give the map of this tip. If both are one tip, give it one name in both "
            "files, or leave the column of a table out (tip=none)",
            inputs=("map_file", "columns"),
        )


def tip_note(touches: Touches, pretravel_map: PretravelMap) -> str:
    """A sentence where touches or map alone state how the head is turned; else empty."""
    made = pretravel_map.provenance
    mine = _head(one_word(touches, "tip"), one_word(touches, "orientation"))
    other = _head(made.tip, made.orientation)
    if bool(mine) == bool(other):
        return ""
    if mine:
        named = one_word(touches, "orientation") or one_word(touches, "tip")
        who = f"the touches are of the orientation {named}, the map states none"
    else:
        who = (
            f"the map is of the orientation {made.orientation or made.tip}, the touches state none"
        )
    return (
        f"{who}: if the head was turned, the pretravel is that of other directions, and U does not "
        "contain this. Give both the orientation (column orientation)"
    )


def stated_by_one(touches: Touches, pretravel_map: PretravelMap) -> list[str]:
    """Sentences about orientations of head and spindle that touches or map alone state."""
    stated = touches.spindle is not None
    alone = stated != (pretravel_map.provenance.spindle_deg is not None)
    turned = orientation_note(pretravel_map, stated=stated) if alone else ""
    return [*filter(None, [tip_note(touches, pretravel_map), turned])]


REVERSAL = "reversal"
"""Orientation of means of touches at 0° and 180° of the spindle, which have no odd lobes."""


def is_reversal(orientation: str) -> bool:
    """Whether an orientation is that of means at two orientations of the spindle.

    >>> is_reversal("A90B0 reversal"), is_reversal("A90B0")
    (True, False)
    """
    return orientation.casefold().endswith(REVERSAL)


def of_means(touches: Touches) -> bool:
    """Whether touches are means at two opposite orientations of the spindle."""
    return is_reversal(one_word(touches, "orientation"))


def _refuse_reversal(touches: Touches, pretravel_map: PretravelMap) -> None:
    """Refuse means with a map of single touches, which has odd lobes, and the other way round."""
    mine = of_means(touches)
    if mine == is_reversal(pretravel_map.provenance.orientation):
        return
    odd = "from means at two orientations of the spindle (pretravel reversal), without odd lobes"
    if not mine:
        raise PretravelError(
            f"the map is {odd}, the touches are single ones, which have them: use means of "
            "touches, or qualify from touches at one orientation. Means say so in a column "
            f"orientation ({REVERSAL})",
            inputs=("map_file",),
        )
    size = error_of_a_turn(pretravel_map)
    if size > 0.0:
        raise PretravelError(
            f"the touches are {odd}, the map has them, up to {0.5 * size * 1e3:.1f} µm: qualify "
            "from means, too",
            inputs=("map_file",),
        )


def refuse_other_orientation(touches: Touches, pretravel_map: PretravelMap) -> None:
    """Refuse touches of another tip, or at another orientation of spindle or head, than the map.

    Raises
    ------
    PretravelError
        Both are stated, and differ; or the touches are of several and the map states none; one
        is of means at two orientations of the spindle, the other is not.
    """
    _refuse_two_heads(touches)
    _refuse_reversal(touches, pretravel_map)
    made = pretravel_map.provenance
    head = _head(made.tip, made.orientation)
    mine = _head(one_word(touches, "tip"), one_word(touches, "orientation"))
    if head and mine and head != mine:
        stated = one_word(touches, "orientation") or one_word(touches, "tip")
        raise PretravelError(
            f"the touches are of the orientation {stated}, the map is of "
            f"{made.orientation or made.tip}: the head has turned, and the directions of the "
            "pretravel with it. Qualify the probe in this orientation",
            inputs=("map_file",),
        )
    _refuse_other_tip(touches, pretravel_map)
    made_at = made.spindle_deg
    if touches.spindle is None:
        return
    angles = touches.spindle / DEGREE
    if made_at is None:
        turned = np.flatnonzero(np.abs(_turn(angles - angles[0])) > SAME_ORIENTATION)
        if len(turned) and (size := error_of_a_turn(pretravel_map)) > 0.0:
            raise PretravelError(
                f"the spindle turns between the touches (to {angles[turned[0]]:g}° at "
                f"{touches.where(int(turned[0]))}, before at {angles[0]:g}°), and the map does not "
                f"state its orientation: at another orientation it is wrong by up to "
                f"{size * 1e3:.1f} µm. Qualify with the orientation (column spindle_deg), and "
                "measure at the same orientation",
                inputs=("map_file",),
            )
        return
    other = np.flatnonzero(np.abs(_turn(angles - made_at)) > SAME_ORIENTATION)
    if len(other):
        raise PretravelError(
            f"{touches.where(int(other[0]))} was made with the spindle turned to "
            f"{angles[other[0]]:g}° ({len(other)} such touches), the map at {made_at:g}°: the "
            "lobes of the probe have turned with it. Measure at the orientation of the map, "
            "qualify at that of the touches, or turn the map "
            f"(in Python: pretravel.maps.turned_to(pretravel_map, {angles[other[0]]:g}))",
            inputs=("map_file",),
        )


def refuse_turned_map(pretravel_map: PretravelMap, spindle_deg: float | None) -> None:
    """Refuse a map for touches that will be made at another orientation of the spindle.

    Parameters
    ----------
    pretravel_map : PretravelMap
    spindle_deg : float or None
        None: it is not turned. [°]

    Raises
    ------
    PretravelError
        The map states another one, or is of means at two.
    """
    made_at = pretravel_map.provenance.spindle_deg
    if is_reversal(pretravel_map.provenance.orientation):
        raise PretravelError(
            "the map is from means at two orientations of the spindle (pretravel reversal), "
            "without odd lobes: touches at one orientation have them. Qualify from touches at one",
            inputs=("compensated",),
        )
    if (
        made_at is not None
        and spindle_deg is not None
        and abs(float(_turn(np.asarray(spindle_deg - made_at)))) > SAME_ORIENTATION
    ):
        raise PretravelError(
            f"the map was made with the spindle at {made_at:g}°, and the program turns it to "
            f"{spindle_deg:g}°: the lobes of the probe turn with it. Measure at the orientation "
            "of the map, or qualify at that of the program",
            inputs=("compensated", "spindle_deg"),
        )


def turned_to(pretravel_map: PretravelMap, spindle_deg: float) -> PretravelMap:
    """The map as the spindle has it at another orientation.

    The probe turns about its axis, counter-clockwise as seen from the spindle's nose towards +z, as
    `Touches.spindle` counts. The run-out of the tip is not contained: it moves all points alike.

    Parameters
    ----------
    pretravel_map : PretravelMap
        States the orientation at which it was qualified.
    spindle_deg : float
        [°]

    Raises
    ------
    PretravelError
        The map does not state its orientation.
    """
    made_at = pretravel_map.provenance.spindle_deg
    if made_at is None:
        raise PretravelError(
            "the map does not give the orientation of the spindle at which it was qualified "
            "(column spindle_deg of its touches): how far to turn it is not known"
        )
    turn = probe_rotation(rotation=(spindle_deg - made_at) * DEGREE)
    return replace(
        pretravel_map,
        rotation=pretravel_map.rotation @ turn,
        provenance=replace(pretravel_map.provenance, spindle_deg=float(spindle_deg)),
    )


def orientation_note(pretravel_map: PretravelMap, *, stated: bool) -> str:
    """What holds where the orientation of map or touches is not stated; empty if nothing does.

    Parameters
    ----------
    pretravel_map : PretravelMap
    stated : bool
        By the touches.
    """
    made_at = pretravel_map.provenance.spindle_deg
    size = error_of_a_turn(pretravel_map)
    both = is_reversal(pretravel_map.provenance.orientation)
    if (stated and made_at is not None) or both or size == 0.0:
        return ""
    if made_at is None and not stated:
        return (
            "no column spindle_deg: if the spindle was turned since the qualification, "
            f"points move by up to {size * 1e3:.1f} µm, which U does not contain"
        )
    if stated:
        who = "the touches give the orientation of the spindle, the map does not"
    else:
        who = f"the map is of spindle {made_at:g}°, the touches have no orientation"
    return (
        f"{who} (column spindle_deg): at another orientation points are wrong "
        f"by up to {size * 1e3:.1f} µm. U does not contain this"
    )


def error_of_a_turn(pretravel_map: PretravelMap) -> float:
    """Largest change of a map by half a turn of the spindle; 0 where it is within U. [mm]"""
    directions, value, u = pretravel_map.over_support()
    opposite = directions * [-1.0, -1.0, 1.0]
    inside = pretravel_map.support.supports(opposite)
    if not inside.any():
        return 0.0
    other = pretravel_map.pretravel(opposite[inside] @ pretravel_map.rotation.T, extrapolate=True)
    change: FloatArray = np.abs(other - value[inside])
    worst = int(np.argmax(change))
    return float(change[worst]) if change[worst] > 2.0 * u[inside][worst] else 0.0


def _turn(degrees: FloatArray) -> FloatArray:
    """In -180 to 180."""
    return np.asarray(np.mod(degrees + 180.0, 360.0) - 180.0)
