"""What a user of the package installs with it: the libraries, their licences and versions.

``make licences`` writes the table of docs/licences.md, docs/results/licences.csv; ``make sbom`` a
CycloneDX file with the versions that are installed here.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
TABLE = ROOT / "docs" / "results" / "licences.csv"

CLASSIFIERS = {
    "Apache Software License": "Apache-2.0",
    "BSD License": "BSD",
    "GNU Lesser General Public License v2 or later (LGPLv2+)": "LGPL-2.1-or-later",
    "ISC License (ISCL)": "ISC",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}

NAMES = r"^(The )?(Apache|BSD|ISC|Intel|L?GPL|MIT|MPL|PSF)"
"""How the name of a licence begins."""


@dataclass(frozen=True)
class Library:
    """A library that comes with pretravel.

    Attributes
    ----------
    name, version, licence : str
        The licence as its metadata state it.
    needed_by : str
        pyproject.toml, an extra of it, or another library.
    """

    name: str
    version: str
    licence: str
    needed_by: str


def libraries() -> list[Library]:
    """Everything that pretravel and its extras need, here; sorted by name.

    Raises
    ------
    PackageNotFoundError
        A library is not installed: make venv.
    """
    found: dict[str, Library] = {}
    waiting = [(need, "pretravel") for need in _needs()]
    waiting += [
        (need, f"extra `{name}`")
        for name, needs in _project()["optional-dependencies"].items()
        for need in map(Requirement, needs)
        if need.name != "pretravel"  # the extra all names the others
    ]
    while waiting:
        need, needed_by = waiting.pop(0)
        name = canonicalize_name(need.name)
        if name in found or (need.marker is not None and not need.marker.evaluate({"extra": ""})):
            continue
        installed = distribution(name)
        found[name] = Library(name, installed.version, licence_of(installed), needed_by)
        waiting += [(each, name) for each in _needs_of(installed, need.extras)]
    return [found[name] for name in sorted(found)]


def _project() -> dict[str, dict[str, list[str]]]:
    found: dict[str, dict[str, list[str]]] = tomllib.loads(
        (ROOT / "pyproject.toml").read_text("utf-8")
    )["project"]
    return found


def _needs() -> list[Requirement]:
    return [Requirement(str(each)) for each in _project()["dependencies"]]


def _needs_of(installed: Distribution, extras: set[str]) -> Iterator[Requirement]:
    """With those of the extras that are asked for."""
    for text in installed.requires or []:
        need = Requirement(text)
        if need.marker is None or any(
            need.marker.evaluate({"extra": extra}) for extra in ("", *extras)
        ):
            need.marker = None
            yield need


def licence_of(installed: Distribution) -> str:
    """The expression of the metadata, or what classifiers and the old field say; else nothing."""
    metadata = installed.metadata
    stated = str(metadata.get("License-Expression") or "")
    classifiers = [
        text.rpartition(" :: ")[2]
        for text in metadata.get_all("Classifier") or []
        if text.startswith("License :: ") and text != "License :: OSI Approved"
    ]
    first = (str(metadata.get("License") or "").strip().splitlines() or [""])[0]
    if stated:
        return stated
    # Some write the whole text of the licence into the field: its first line names none.
    if len(first) < 60 and re.search(NAMES, first):
        return first
    return " and ".join(CLASSIFIERS.get(text, text) for text in classifiers)


def table(found: list[Library]) -> str:
    """The libraries as a table in CSV."""
    text = io.StringIO()
    rows = [(each.name, each.licence, each.needed_by) for each in found]
    csv.writer(text, lineterminator="\n").writerows([("library", "licence", "needed by"), *rows])
    return text.getvalue()


def bill_of_materials(found: list[Library], version: str) -> dict[str, object]:
    """The libraries as a CycloneDX 1.6 document, which tools for known flaws read."""
    own = {
        "type": "application",
        "bom-ref": f"pkg:pypi/pretravel@{version}",
        "name": "pretravel",
        "version": version,
        "purl": f"pkg:pypi/pretravel@{version}",
        "licenses": [{"license": {"id": "MIT"}}],
    }
    components = [
        {
            "type": "library",
            "bom-ref": f"pkg:pypi/{each.name}@{each.version}",
            "name": each.name,
            "version": each.version,
            "purl": f"pkg:pypi/{each.name}@{each.version}",
            "licenses": [{"license": {"name": each.licence}}],
        }
        for each in found
    ]
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": own},
        "components": components,
    }


def main() -> None:
    """Write the table, or the bill of materials."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sbom", type=Path, help="write a CycloneDX file, not the table")
    wanted = parser.parse_args()
    try:
        found = libraries()
    except PackageNotFoundError as error:
        sys.exit(f"{error}: make venv")
    if wanted.sbom:
        content = bill_of_materials(found, distribution("pretravel").version)
        wanted.sbom.write_text(json.dumps(content, indent=1) + "\n", "utf-8")
        return
    TABLE.write_text(table(found), "utf-8")


if __name__ == "__main__":
    main()
