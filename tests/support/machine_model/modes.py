"""The modes of the control: what stays from line to line."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

Vector = tuple[float, float, float]
INCH = 25.4
ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Modes:
    """Modes as words of G-code. Lengths are in mm.

    Attributes
    ----------
    motion : str
        The motion that axis words alone repeat; "G80" for none.
    tool_offset : tuple
        The length offset in use (G43, G43.1); zero with G49. [mm]
    path : str
        G61, G61.1 or G64, with its P and Q.
    feed, speed : float
        F and S as programmed. The feed is in mm/min, or per minute with G93.
    shift : tuple
        The offset of G92 or G52. [mm]
    """

    motion: str = "G80"
    plane: str = "G17"
    units: str = "G21"
    distance: str = "G90"
    feed_mode: str = "G94"
    lathe: str = "G8"
    work_offset: str = "G54"
    tool_offset: Vector = ZERO
    path: str = "G64"
    feed: float = 0.0
    speed: float = 0.0
    spindle: str = "M5"
    mist: bool = False
    flood: bool = False
    feed_override: bool = True
    speed_override: bool = True
    adaptive_feed: bool = False
    feed_hold: bool = True
    shift: Vector = ZERO

    @property
    def unit(self) -> float:
        """Millimetres in one unit of the program."""
        return INCH if self.units == "G20" else 1.0


def restored(now: Modes, saved: Modes, tool_length: Vector) -> Modes:
    """The modes after M72: what LinuxCNC gets back, and what it does not.

    G43 comes back with the length of the tool in the spindle; an adaptive feed or a feed hold that
    was off does not come back off; F comes back with one decimal, in the units of the program.
    """
    unit = saved.unit
    offset = now.tool_offset
    if (now.tool_offset == ZERO) != (saved.tool_offset == ZERO):
        offset = ZERO if saved.tool_offset == ZERO else tool_length
    feed = now.feed if saved.feed_mode == now.feed_mode else 0.0
    if now.feed != saved.feed and saved.feed_mode != "G93":
        feed = round(saved.feed / unit, 1) * unit
    # Only a feed override that was on comes back, with M48; else M51 is given.
    changed = now.feed_override != saved.feed_override
    return replace(
        now,
        plane=saved.plane,
        units=saved.units,
        distance=saved.distance,
        feed_mode=saved.feed_mode,
        work_offset=saved.work_offset,
        tool_offset=offset,
        path=saved.path,
        feed=feed,
        speed=float(round(saved.speed)),
        spindle=saved.spindle,
        mist=saved.mist or (now.mist and saved.flood),
        flood=saved.flood or (now.flood and saved.mist),
        feed_override=now.feed_override or saved.feed_override,
        speed_override=now.speed_override or changed,
        adaptive_feed=saved.adaptive_feed or now.adaptive_feed,
        feed_hold=saved.feed_hold or now.feed_hold,
    )


def after_program_end(now: Modes) -> Modes:
    """The modes after M2 or M30."""
    return replace(
        now,
        motion="G1",
        plane="G17",
        distance="G90",
        feed_mode="G94",
        work_offset="G54",
        feed=0.0,
        spindle="M5",
        mist=False,
        flood=False,
        feed_override=True,
        speed_override=True,
    )


def differences(first: Modes, second: Modes, names: tuple[str, ...] = ()) -> dict[str, str]:
    """What differs between modes: "was → is" by name."""
    found = {}
    for name in names or tuple(f.name for f in fields(Modes)):
        was, now = getattr(first, name), getattr(second, name)
        if was != now:
            found[name] = f"{was} → {now}"
    return found
