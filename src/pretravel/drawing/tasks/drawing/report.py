"""The report of a drawing that a model carries: one line for each datum, size and tolerance."""

from __future__ import annotations

from pretravel.drawing.pmi.model import ModelDrawing
from pretravel.show import Column, Document, Picture, Section, Table, part_view


def drawing_document(model: ModelDrawing) -> Document:
    """The report."""
    name = model.part.name
    pictures = (Picture("Faces and their numbers", lambda: part_view(model.part)),)
    if not model.has_pmi:
        features = model.drawn.features
        return Document(
            title=name,
            verdict=f"{name} has no tolerances that software can read (semantic PMI, AP242)"
            f"{_drawn(model.pmi.annotations)}; "
            + (
                f"the drawing lists {_count(len(features), 'feature')} with a diameter: give the "
                "tolerances"
                if features
                else "it has no bores, bosses or spheres"
            ),
            tables=(_skeleton_table(model),) if features else (),
            pictures=pictures,
            warnings=_texts(model),
        )
    pmi, lines = model.pmi, model.lines
    left = [each for each in lines if each.left_out]
    sections = (
        Section(
            "What measure cannot evaluate",
            tables=(
                Table(
                    (
                        Column.of("item", [f"{each.what} (#{each.number})" for each in left]),
                        Column.of("why", [each.left_out for each in left]),
                    )
                ),
            ),
        ),
    )
    return Document(
        title=name,
        verdict=f"{name}: {_count(len(pmi.datums), 'datum')}, {_count(len(pmi.sizes), 'size')} and "
        f"distances, {_count(len(pmi.tolerances), 'geometric tolerance')}; "
        f"measure can evaluate {_evaluated(len(lines), len(left))}",
        tables=(
            Table(
                (
                    Column.of("item", [each.what for each in lines]),
                    Column.of("limits or zone", [each.limits for each in lines]),
                    Column.of("datums", [each.datums for each in lines]),
                    Column.of("face no.", [each.faces for each in lines]),
                    Column.of("evaluated", ["no" if each.left_out else "yes" for each in lines]),
                )
            ),
        ),
        sections=sections if left else (),
        pictures=pictures,
        warnings=(
            *_texts(model),
            *(f"not understood: #{each.number} = {each.text}" for each in pmi.unread),
        ),
    )


def _texts(model: ModelDrawing) -> tuple[str, ...]:
    return tuple(f"the model says in words, which nothing here decides: {each}"
                 for each in model.pmi.texts)  # fmt: skip


def _evaluated(items: int, left_out: int) -> str:
    return f"{items - left_out} of these {items}" if left_out else f"all {items}"


def _skeleton_table(model: ModelDrawing) -> Table:
    features = model.drawn.features
    return Table(
        (
            Column.of("feature", [each.label for each in features]),
            Column.of("diameter", [each.nominal or 0.0 for each in features], "mm"),
            Column.of(
                "faces",
                [
                    ", ".join(str(model.numbers.get(f.number, f"#{f.number}")) for f in each.faces)
                    for each in features
                ],
            ),
        )
    )


def _drawn(annotations: int) -> str:
    """What to do where the tolerances are drawn, and not stated."""
    if not annotations:
        return ""
    return (
        f" but {_count(annotations, 'annotation')} for people to read: export it with semantic "
        "PMI (representation, not presentation alone)"
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
