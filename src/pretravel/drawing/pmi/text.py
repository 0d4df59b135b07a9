"""The PMI of a model in lines that people read, and as a file of features (TOML)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from pretravel.drawing.pmi.drawn import DrawnPmi, FeatureInWork
from pretravel.drawing.pmi.items import Place, Pmi, PmiDatum, Size, Tolerance
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance

_HEAD = """\
# {title}
# Features for `pretravel measure`, as docs/how-to/tolerances.md describes them.
# Touches of a feature are those on its faces, as `pretravel align` writes them; or give
# `select = "bore1-*"`, the labels of the touches, instead of `faces`.
"""


@dataclass(frozen=True)
class ItemLine:
    """One item of PMI in words.

    Attributes
    ----------
    number : int
        Of its instance.
    what : str
        PmiDatum A; diameter; position.
    limits : str
        Limits or zone, with modifiers. In mm or degrees.
    datums : str
        ``A|B|C(M)``.
    faces : str
        As `pretravel faces` numbers them.
    left_out : str
        Why the file of features does not state it; empty where it does.
    """

    number: int
    what: str
    limits: str
    datums: str
    faces: str
    left_out: str = ""


def item_lines(pmi: Pmi, numbers: dict[int, int], left_out: dict[int, str]) -> list[ItemLine]:
    """A line for each datum, target, size and tolerance, in this order.

    Parameters
    ----------
    pmi : Pmi
    numbers : mapping of int to int
        Of the faces.
    left_out : mapping of int to str
    """
    lines: list[ItemLine] = []
    for datum in pmi.datums:
        why = left_out.get(datum.number, "")
        lines.append(
            ItemLine(
                datum.number, f"datum {datum.letter}", "", "", _faces(datum.place, numbers), why
            )
        )
        lines += _target_lines(datum, numbers, why)
    for size in pmi.sizes:
        faces = " to ".join(_faces(place, numbers) for place in size.places)
        why = left_out.get(size.number, "")
        lines.append(ItemLine(size.number, size.quantity, _limits(size), "", faces, why))
    for each in pmi.tolerances:
        lines.append(
            ItemLine(
                each.number,
                each.kind,
                _zone(each),
                "|".join(datum.text for datum in each.datums),
                _faces(each.place, numbers),
                left_out.get(each.number, ""),
            )
        )
    return lines


def _target_lines(datum: PmiDatum, numbers: dict[int, int], why: str) -> Iterator[ItemLine]:
    for each in datum.targets:
        sizes = ", ".join(f"{one.name} {one.value:.10g} {one.unit}" for one in each.sizes)
        at = "" if each.at is None else f"at {_vector(each.at)}"
        words = ", ".join(filter(None, (each.form, sizes, at)))
        name = f"target {datum.letter}{each.name.removeprefix(datum.letter)}"
        yield ItemLine(each.number, name, words, "", _faces(each.place, numbers), why)


def _faces(place: Place, numbers: dict[int, int]) -> str:
    if place.whole:
        return "all"
    own = [str(numbers.get(number, f"#{number}")) for number in place.faces]
    return ", ".join([*own, *place.others]) or "none"


def _limits(size: Size) -> str:
    parts = []
    if size.nominal is not None:
        parts.append(f"{size.nominal:.10g}{f' {size.fit}' if size.fit else ''}")
    if size.lower is not None or size.upper is not None:
        low, high = ("" if end is None else f"{end:.10g}" for end in (size.lower, size.upper))
        parts.append(f"{low}..{high}")
    text = ", ".join(parts)
    unit = f" {size.unit}" if text else "no value"
    return " ".join(filter(None, (f"{text}{unit}", *(f"({note})" for note in size.notes))))


def _zone(tolerance: Tolerance) -> str:
    zone = "no value" if tolerance.zone is None else f"{tolerance.zone:.10g} mm"
    form = f", {tolerance.form} zone" if tolerance.form else ""
    return " ".join([zone + form, *(f"({sign})" for sign in tolerance.signs)])


def _vector(values: Iterable[float]) -> str:
    return "[" + ", ".join(_number(value) for value in values) + "]"


def features_text(
    title: str, pmi: Pmi, drawn: DrawnPmi, numbers: dict[int, int], more: str = ""
) -> str:
    """The file of features, with what it cannot state as comments.

    Parameters
    ----------
    title : str
    pmi : Pmi
    drawn : DrawnPmi
    numbers : mapping of int to int
    more : str
        Further comment at the beginning.
    """
    blocks = [_HEAD.format(title=_one_line(title)) + more]
    left = [each for each in item_lines(pmi, numbers, drawn.left_out) if each.left_out]
    if left:
        blocks.append(
            "# Not measured by this file. Each tolerance of these has a table at its end, and a "
            "line in the report:\n" + "".join(_comment(each) for each in left)
        )
    if pmi.texts:
        texts = "".join(f"#   {_one_line(each)}\n" for each in pmi.texts)
        blocks.append("# In words, which nothing here decides:\n" + texts)
    if pmi.unread:
        texts = "".join(
            f"#   {_one_line(f'#{each.number} = {each.text}')}\n" for each in pmi.unread
        )
        blocks.append("# Not understood, or used by nothing that is understood:\n" + texts)
    blocks += [_feature_text(each, numbers) for each in drawn.features]
    for pattern in drawn.patterns:
        lines = [
            "[[pattern]]",
            f"label = {_text(pattern.label)}",
            f"features = {_words(pattern.features)}",
            f"position_tolerance_mm = {_number(pattern.position_tolerance)}",
        ]
        lines += [f"datums = {_words(pattern.datums)}"] if pattern.datums else []
        lines += _more(pattern.tolerance)
        blocks.append("\n".join(lines) + "\n")
    for relation in drawn.between:
        lines = ["[[between]]", f"features = {_words(relation.features)}"]
        lines += ['quantity = "angle"'] if relation.quantity == "angle" else []
        lines += [] if relation.nominal is None else [f"nominal = {_number(relation.nominal)}"]
        lines.append(f"tolerance = {_text(relation.tolerance)}")
        blocks.append("\n".join(lines) + "\n")
    for each in drawn.not_decided:
        lines = ["[[not_decided]]", f"feature = {_text(each.feature)}"]
        lines.append(f"characteristic = {_text(each.characteristic)}")
        lines += [f"limits = {_text(each.limits)}"] if each.limits else []
        blocks.append("\n".join([*lines, f"reason = {_text(each.reason)}"]) + "\n")
    return "\n".join(blocks)


def _more(tolerance: GeometricTolerance) -> list[str]:
    """The keys of a frame that few have."""
    lines = [f"material = {_text(tolerance.material)}"] if tolerance.material else []
    lines += ["tangent = true"] if tolerance.tangent else []
    lines += [f"offset_mm = {_number(tolerance.offset)}"] if tolerance.offset else []
    lines += [f"between_mm = {_vector(tolerance.between)}"] if tolerance.between else []
    lines += [f"instead_of = {_text(tolerance.instead_of)}"] if tolerance.instead_of else []
    return lines + ([f"remark = {_text(tolerance.remark)}"] if tolerance.remark else [])


def _comment(line: ItemLine) -> str:
    to = f" to {line.datums}" if line.datums else ""
    limits = f" {line.limits}" if line.limits else ""
    words = f"{line.what}{limits}{to}, faces {line.faces} (#{line.number})"
    return f"#   {_one_line(f'{words}: {line.left_out}')}\n"


def _feature_text(own: FeatureInWork, numbers: dict[int, int]) -> str:
    drawn = own.drawn
    faces = ", ".join(str(numbers.get(face.number, f"#{face.number}")) for face in own.faces)
    by_label = f"select = {_text(drawn.select)}  # face{'s' * (len(own.faces) > 1)} {faces}"
    lines = ["[[feature]]", f"label = {_text(drawn.label)}", f"kind = {_text(drawn.kind)}"]
    lines.append(f"faces = {list(drawn.faces)}" if drawn.faces else by_label)
    if drawn.targets:
        lines.append(f"targets_mm = [{', '.join(map(_vector, drawn.targets))}]")
    if drawn.target_lines:
        lines.append(f"target_lines_mm = [{', '.join(map(_vector, drawn.target_lines))}]")
    lines += [] if drawn.association is None else [f"association = {_text(drawn.association)}"]
    lines += [] if drawn.at is None else [f"at_mm = {_vector(drawn.at)}"]
    lines += [] if drawn.axis is None else [f"axis = {_vector(drawn.axis)}"]
    lines += [] if drawn.nominal is None else [f"nominal_mm = {_number(drawn.nominal)}"]
    if drawn.tolerance is not None:
        lines.append(f"tolerance = {_text(drawn.tolerance)}")
    elif drawn.nominal is not None:
        lines.append('# tolerance = "+0.1/-0.1"')
    if drawn.form_tolerance is not None:
        lines.append(f"form_tolerance_mm = {_number(drawn.form_tolerance)}")
    lines += [f"# {_one_line(remark)}" for remark in own.remarks]
    for each in drawn.geometric:
        lines += ["  [[feature.geometric]]", f"  kind = {_text(each.kind)}"]
        lines.append(f"  tolerance_mm = {_number(each.zone)}")
        lines += [f"  datums = {_words(each.datums)}"] if each.datums else []
        lines += [f"  {line}" for line in _more(each)]
    return "\n".join(lines) + "\n"


def _text(word: str) -> str:
    """A string of TOML, which has the escapes of JSON."""
    return json.dumps(word, ensure_ascii=False)


def _one_line(words: str) -> str:
    """As a comment can have it: names in a file may contain ends of lines."""
    return "".join(sign if sign.isprintable() else " " for sign in words)


def _words(words: Iterable[str]) -> str:
    return "[" + ", ".join(_text(word) for word in words) + "]"


def _number(value: float) -> str:
    """With a point: TOML tells floats from integers."""
    text = f"{value:.10g}"
    return text if "." in text or "e" in text else f"{text}.0"
