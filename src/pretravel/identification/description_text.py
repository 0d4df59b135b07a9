"""The text of a probe's description, with identified quantities in it."""

from __future__ import annotations

from pretravel.identification.free_numbers import FREE
from pretravel.identification.probe_from_map import Identification
from pretravel.prediction.catalogue import rewritten


def identified_description(text: str, found: Identification, source: str) -> str:
    """A description with the identified quantities and their uncertainties.

    Parameters
    ----------
    text : str
        TOML of the description from which the identification started.
    found : Identification
    source : str
        Name of the map, for the sources of the numbers.

    Returns
    -------
    str
        TOML; comments and other quantities stay as they are.
    """
    changes = {}
    for name, value, u in zip(found.names, found.values, found.standard_uncertainty, strict=True):
        number = FREE[name]
        # A description states the hub offset: lever = stylus length + hub offset.
        written = value - found.probe.stylus_length if name == "lever" else value
        changes[f"{number.table}.{number.key}"] = (
            float(f"{written / number.unit:.9g}"),
            f"identified from {source}, u = {u / number.unit:.2g}",
        )
    return rewritten(text, changes)
