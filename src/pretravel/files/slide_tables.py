"""One touch, step by step, as a table: one row per step."""

from __future__ import annotations

import numpy.typing as npt

from pretravel.probing import SlideHistory
from pretravel.six_seats import SEAT_NAMES


def slide_table(history: SlideHistory) -> dict[str, npt.ArrayLike]:
    """Return the steps of a touch as columns, with the reactions of the seats.

    Returns
    -------
    mapping of str to (k,) values
        step, feed_mm, deflection_mm; spindle point Px…, tip centre Cx… and contact point Tx… in
        mm; normal nx…; force_N and reaction_*_N, empty after the trigger; triggered (0 or 1).
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
    return columns
