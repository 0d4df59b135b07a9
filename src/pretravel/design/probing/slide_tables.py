"""One touch, step by step, as a table: one row per step."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pretravel.design.probing.slide_history import SlideHistory
from pretravel.six_seats import SEAT_NAMES


def slide_table(history: SlideHistory) -> dict[str, npt.ArrayLike]:
    """Return the steps of a touch as columns, with the reactions of the seats.

    Returns
    -------
    mapping of str to (k,) values
        step, feed_mm, deflection_mm; spindle point Px…, tip centre Cx… and contact point Tx… in
        mm; normal nx…; force_N, reaction_*_N and penetration_*_mm, empty after the trigger;
        triggered (0 or 1); open_seat; on an inclined face applied_force_N.
    """
    columns: dict[str, npt.ArrayLike] = {
        "step": history.step,
        "feed_mm": history.feed,
        "deflection_mm": history.deflection,
    }
    for letter, vectors in (
        ("C", history.center),
        ("T", history.contact),
        ("n", history.normal),
        ("P", history.spindle),
    ):
        columns |= {f"{letter}{axis}": vectors[:, i] for i, axis in enumerate("xyz")}
    columns["force_N"] = history.force
    columns["triggered"] = history.triggered.astype(int)
    for seat, name in enumerate(SEAT_NAMES):
        columns[f"reaction_{name}_N"] = history.reactions[:, seat]
    for seat, name in enumerate(SEAT_NAMES):
        columns[f"penetration_{name}_mm"] = history.penetration[:, seat]
    names = (*SEAT_NAMES, "")  # -1: none is open
    columns["open_seat"] = np.array([names[seat] for seat in history.open_seat.tolist()])
    if np.isfinite(history.applied).any():
        columns["applied_force_N"] = history.applied
    return columns
