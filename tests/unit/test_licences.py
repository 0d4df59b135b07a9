"""docs/licences.md names every library of an installation, and explains what asks for more."""

from __future__ import annotations

import csv
import json
import re
from email.message import Message
from importlib.metadata import Distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools import licences

PERMISSIVE = r"0BSD|Apache|BSD|CC0|ISC|MIT|PSF|Zlib"


def _page() -> tuple[str, dict[str, str]]:
    """The prose, and the licence of each library of the table."""
    prose = (licences.ROOT / "docs" / "licences.md").read_text("utf-8")
    with licences.TABLE.open(encoding="utf-8", newline="") as file:
        return prose, {name: licence for name, licence, _ in csv.reader(file)}


def test_every_library_here_is_in_the_table() -> None:
    """``make licences`` writes the table."""
    table = _page()[1]
    assert table.pop("library") == "licence"
    here = {each.name: each.licence for each in licences.libraries()}
    # Python 3.11 on x86-64, as the page says; other versions and systems have others.
    extra = {"lazy-importer", "importlib-metadata", "zipp", "tzdata", "colorama"}
    assert {name for name in here if name not in table} <= extra
    changed = {name for name, licence in here.items() if table.get(name, licence) != licence}
    assert changed == set()


def test_what_the_project_asks_for_is_in_the_table() -> None:
    project = licences._project()
    extras = [need for needs in project["optional-dependencies"].values() for need in needs]
    asked = {
        canonicalize_name(Requirement(str(n)).name) for n in [*project["dependencies"], *extras]
    } - {"pretravel"}
    assert asked <= set(_page()[1])


def test_what_is_not_permissive_is_explained() -> None:
    prose, table = _page()
    others = {
        name
        for name, licence in table.items()
        if not all(re.search(PERMISSIVE, part) for part in re.split(r" and | AND ", licence))
    }
    assert {"netgen-mesher", "netgen-occt", "mkl", "certifi"} <= others
    assert {name for name in others if not re.search(rf"\b{name}\b", prose)} == set()


class _Installed(Distribution):
    def __init__(self, *fields: tuple[str, str]) -> None:
        self._fields = Message()
        for name, value in fields:
            self._fields[name] = value

    @property
    def metadata(self) -> Message:  # type: ignore[override]
        return self._fields

    def read_text(self, filename: str) -> None: ...

    def locate_file(self, path: object) -> Path:  # type: ignore[override]
        raise AssertionError


BSD = ("Classifier", "License :: OSI Approved :: BSD License")


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ([("License-Expression", "MIT"), ("License", "x"), BSD], "MIT"),
        ([("License", "Apache 2.0"), BSD], "Apache 2.0"),
        ([("License", "Copyright (c) 2015, somebody\n Redistribution …"), BSD], "BSD"),
        (
            [("License", "BSD, and all of its text in one line, which goes on and on " * 2), BSD],
            "BSD",
        ),
        ([("License", "==========\nThe text"), BSD], "BSD"),
        ([("Classifier", "License :: OSI Approved")], ""),
        ([("Classifier", "License :: OSI Approved :: Odd License"), BSD], "Odd License and BSD"),
    ],
)
def test_the_licence_of_metadata(fields: list[tuple[str, str]], expected: str) -> None:
    assert licences.licence_of(_Installed(*fields)) == expected


def test_every_library_states_a_licence() -> None:
    assert [each.name for each in licences.libraries() if not each.licence] == []


def test_the_bill_of_materials_has_each_library_once() -> None:
    found = licences.libraries()
    bill = json.loads(json.dumps(licences.bill_of_materials(found, "1.0")))
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert bill["metadata"]["component"]["purl"] == "pkg:pypi/pretravel@1.0"
    references = [each["bom-ref"] for each in bill["components"]]
    assert references == [f"pkg:pypi/{each.name}@{each.version}" for each in found]
    assert len(set(references)) == len(references) > 50
