"""The words of a page with their meaning."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from pretravel.show.document import Document, KeyFigure, Section, Table


@dataclass(frozen=True)
class GlossaryEntry:
    """A word of the field.

    Attributes
    ----------
    term : str
        As docs/nomenclature.md has it.
    meaning : str
    unit : str
        Inside the library; empty where there is none.
    find : tuple of str or None
        Words of a page by which the entry is shown; None: those of the term.
    """

    term: str
    meaning: str
    unit: str = ""
    find: tuple[str, ...] | None = None

    @property
    def words(self) -> tuple[str, ...]:
        """The words by which the entry is shown.

        >>> GlossaryEntry("sector, vector radius", "of a table").words
        ('sector', 'vector radius')
        """
        if self.find is not None:
            return self.find
        return tuple(re.sub(r"\s*\(.*?\)", "", self.term).split(", "))

    @property
    def anchor(self) -> str:
        """The name of the place of an entry in a page.

        >>> GlossaryEntry("sector, vector radius", "of a table").anchor
        'word-sector-vector-radius'
        """
        return f"word-{re.sub(r'[^a-z0-9]+', '-', self.term.lower()).strip('-')}"


@cache
def glossary() -> tuple[GlossaryEntry, ...]:
    """All entries, in the order of docs/nomenclature.md.

    They are the package's own: what checks files of users takes ten times as long as reading them.
    """
    text = files("pretravel.show").joinpath("glossary.toml").read_text(encoding="utf-8")
    return tuple(
        GlossaryEntry(**{**word, "find": tuple(word["find"]) if "find" in word else None})
        for word in tomllib.loads(text)["word"]
    )


def words_used(documents: Iterable[Document]) -> tuple[GlossaryEntry, ...]:
    """The entries whose words occur in documents.

    Parameters
    ----------
    documents : iterable of Document

    >>> [entry.term for entry in words_used([Document("Pretravel of a probe")])]
    ['pretravel']
    """
    text = "\n".join(part for document in documents for part in _texts(document))
    for other in ("standard deviation", "Deviations from the procedure"):  # none of a point
        text = text.replace(other, "")
    small = text.lower()  # to compile a pattern takes as long as to search ten texts
    return tuple(
        entry
        for entry in glossary()
        if any(word.lower() in small for word in entry.words) and _pattern(entry.words).search(text)
    )


@cache
def _pattern(words: tuple[str, ...]) -> re.Pattern[str]:
    """Any of the words, also in the plural; letters such as u and U only as they are."""
    found = [
        re.escape(word) if len(word) == 1 else f"(?i:{re.escape(word)}(?:s|es)?)" for word in words
    ]
    return re.compile(rf"(?<![\w.-])(?:{'|'.join(found) or '(?!)'})(?![\w-])")


def _texts(document: Document) -> Iterator[str]:
    """All texts of a document that a reader sees."""
    yield from (document.title, document.verdict, *document.notes, *document.warnings)
    yield from (picture.caption for picture in document.pictures)
    yield from _figure_texts(document.figures)
    for table in document.tables:
        yield from _table_texts(table)
    for section in document.sections:
        yield from _section_texts(section)


def _section_texts(section: Section) -> Iterator[str]:
    yield from (section.heading, *section.paragraphs)
    yield from _figure_texts(section.figures)
    for table in section.tables:
        yield from _table_texts(table)


def _figure_texts(figures: Iterable[KeyFigure]) -> Iterator[str]:
    for figure in figures:
        yield from (figure.name, figure.remark)
        if isinstance(figure.value, str):
            yield figure.value
        if figure.u is not None:
            yield "expanded uncertainty"


def _table_texts(table: Table) -> Iterator[str]:
    yield from (table.title, table.explanation)
    for column in table.columns:
        yield column.name
        yield from (value for value in column.values[:200] if isinstance(value, str))
