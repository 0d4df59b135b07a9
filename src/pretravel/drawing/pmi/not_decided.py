"""Lines of the answer for what the PMI states and the file of features cannot state."""

from __future__ import annotations

from pretravel.drawing.pmi.items import Place, Pmi
from pretravel.drawing.pmi.measures import ANGLE_UNIT
from pretravel.drawing.tolerances.features_file import NotDecided


def lines_not_decided(
    pmi: Pmi, numbers: dict[int, int], left_out: dict[int, str]
) -> tuple[NotDecided, ...]:
    """The tolerances that are not in the file: each has a line in the answer all the same.

    Parameters
    ----------
    pmi : Pmi
    numbers : mapping of int to int
        Of the faces, as `pretravel faces` lists them.
    left_out : mapping of int to str
        Items that the file cannot state, by their instances, and why.
    """
    found = []
    for size in pmi.sizes:
        if size.number in left_out and (
            size.fit or size.unclear or size.lower is not None or size.upper is not None
        ):
            places = " to ".join(place_words(place, numbers) for place in size.places)
            sign = "°" if size.unit == ANGLE_UNIT else ""
            known = size.lower is not None or size.upper is not None
            found.append(
                NotDecided(
                    f"{places} (#{size.number})",
                    " ".join(filter(None, (size.quantity, size.fit))),
                    left_out[size.number],
                    f"{size.limits()}{sign}" if known else "",
                )
            )
    for each in pmi.tolerances:
        if each.number in left_out:
            signs = "".join(f" ({sign})" for sign in each.signs)
            to = "|".join(datum.text for datum in each.datums)
            found.append(
                NotDecided(
                    f"{place_words(each.place, numbers)} (#{each.number})",
                    f"{each.kind}{signs}{f' to {to}' if to else ''}",
                    left_out[each.number],
                    "" if each.zone is None else f"0..{each.zone:.10g}",
                )
            )
    found += [
        NotDecided(
            f"#{each.number}", "not understood",
            f"{each.why or 'nothing that is understood refers to it'}: {each.text}",
        )
        for each in pmi.unread if each.is_tolerance
    ]  # fmt: skip
    return tuple(found)


def place_words(place: Place, numbers: dict[int, int]) -> str:
    """Faces by the numbers of `pretravel faces`: ``face 3``, ``faces 3, 4``."""
    if place.whole:
        return "the whole part"
    own = [str(numbers.get(number, f"#{number}")) for number in place.faces]
    named = [f"face{'s' * (len(own) > 1)} {', '.join(own)}"] if own else []
    return ", ".join([*named, *place.others]) or "no face"
