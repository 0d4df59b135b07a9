"""Whether what is used of a standard was compared with its text."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a report without statements does not need their tables
    from pretravel.files.laboratory_statements import LaboratoryStatements


def comparison_sentence(standard: str, statements: LaboratoryStatements | None) -> str:
    """Whether the definitions of a standard were compared with its text, for every reader.

    >>> print(comparison_sentence("ISO 10360-5", None))
    The rules of ISO 10360-5 were programmed without the text of the standard and were not \
checked against it.
    >>> from pretravel.files.laboratory_statements import (
    ...     ComparedStandards, LaboratoryIdentity, LaboratoryStatements)
    >>> stated = LaboratoryStatements(
    ...     LaboratoryIdentity("North Ltd, Aberdeen"),
    ...     standards=ComparedStandards(iso_10360_5="edition 2020, A. Lee, 2026-03-02"),
    ... )
    >>> print(comparison_sentence("ISO 10360-5", stated))
    North Ltd declares that it compared what is used here of ISO 10360-5 with its text (edition \
2020, A. Lee, 2026-03-02).
    """
    name = standard.partition(",")[0]
    compared = "" if statements is None else statements.compared(standard)
    if statements is None or not compared:
        return (
            f"The rules of {name} were programmed without the text of the standard and were not "
            "checked against it."
        )
    laboratory = re.split(r"[,\n]", statements.laboratory.name)[0].strip() or "The laboratory"
    return (
        f"{laboratory} declares that it compared what is used here of {name} with its text "
        f"({compared})."
    )
