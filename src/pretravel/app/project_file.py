"""A project as one file: a zip archive of ``project.json`` and the user's files.

The format has a number of its own. Reading is defensive: a project can come from a stranger. Only
the entries that ``project.json`` lists are read, each with its stated size, and nothing is
unpacked to the disk.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pretravel.app.project import (
    LARGEST_PROJECT,
    OF_ALL_SCREENS,
    Link,
    Project,
    SettingValue,
    StoredFile,
    check_file_name,
)
from pretravel.base import InputError, PretravelError, installed_version, parsed_json, whole_file

PROJECT_ENDING = ".pretravel"
_FORMAT, _VERSION = "pretravel project", 1
_JSON = "project.json"
_LARGEST_JSON = 20_000_000
_MOST_ENTRIES = 2000
_LARGEST_END = 1100 * _MOST_ENTRIES
"""Of an archive: its directory. [bytes]"""
_NAME = re.compile(r"[a-z][a-z0-9_-]{0,40}")
"""Names of screens and of purposes of files."""
_DAMAGED = (
    zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, RuntimeError,
    NotImplementedError, ValueError, OverflowError, KeyError,
)  # fmt: skip
"""What zipfile raises for archives that are damaged, encrypted or of unknown compression."""


def project_bytes(project: Project) -> bytes:
    """The content of the file of a project.

    >>> project = Project("Probe 7")
    >>> project.screen("engineer").files["touches"] = (StoredFile("a.csv", b"x_mm"),)
    >>> project_of(project_bytes(project)).screen("engineer").files["touches"][0].content
    b'x_mm'
    """
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        screens: dict[str, Any] = {}
        for state in project.screens:
            listed: dict[str, Any] = {}
            for purpose, files in state.files.items():
                for file in files:
                    entry = f"files/{state.name}/{purpose}/{file.name}"
                    archive.writestr(entry, file.content)
                listed[purpose] = [{"name": f.name, "size": len(f.content)} for f in files]
            screens[state.name] = {
                "settings": state.settings.plain(),
                "files": listed,
                "links": {name: asdict(link) for name, link in state.links.items()},
            }
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "pretravel": installed_version(),
            "name": project.name,
            "identity": project.identity,
            "shared": project.shared.plain(),
            "screens": screens,
        }
        archive.writestr(_JSON, json.dumps(content, ensure_ascii=False, indent=1))
    return target.getvalue()


def write_project(path: str | Path, project: Project) -> None:
    """Write a project, whole or not at all."""
    content = project_bytes(project)
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def read_project_names(path: str | Path) -> tuple[str, tuple[str, ...]]:
    """The name of a project and of its files, without their contents.

    Raises
    ------
    InputError
        As `read_project`, of what is read.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_PROJECT:
            raise InputError("it is larger than any project", path=path)
        with path.open("rb") as content:
            size = content.seek(0, io.SEEK_END)
            content.seek(max(size - _LARGEST_END, 0))
            _refuse_directory(content.read(), path)
            with zipfile.ZipFile(content) as archive:
                stated = _stated(_Entries(archive, path), path)
        files = [
            str(file["name"])
            for screen in stated["screens"].values()
            for listed in screen["files"].values()
            for file in listed
        ]
        return str(stated["name"])[:100], tuple(dict.fromkeys(files))
    except PretravelError:
        raise
    except (*_DAMAGED, TypeError, AttributeError) as error:
        raise InputError(f"this project is damaged ({error})", path=path) from error


def read_project(path: str | Path) -> Project:
    """Read a project.

    Raises
    ------
    InputError
        It is missing, damaged, too large or no project.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_PROJECT:
            raise InputError(
                f"it has more than {LARGEST_PROJECT // 10**6} MB, which no project has", path=path
            )
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"it cannot be read: {error.strerror or error}", path=path) from error
    return project_of(content, path)


def project_of(content: bytes, path: str | Path = "the project") -> Project:
    """The project of the content of a file.

    Parameters
    ----------
    content : bytes
    path : str or Path
        For messages.

    Raises
    ------
    InputError
        It is damaged, too large or no project.

    >>> project_of(b"x_mm,y_mm", "touches.csv")
    Traceback (most recent call last):
        ...
    pretravel.base.errors.InputError: touches.csv: this is not a project of pretravel: ...
    """
    try:
        _refuse_directory(content, path)
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return _project(_Entries(archive, path), path)
    except PretravelError:
        raise
    except _DAMAGED as error:
        reason = "this is not a project of pretravel"
        if content[:2] == b"PK":
            reason = f"this project is damaged ({error})"
        raise InputError(
            f"{reason}: open a file that the workbench saved (*{PROJECT_ENDING})", path=path
        ) from error


def _refuse_directory(content: bytes, path: str | Path) -> None:
    """Before zipfile makes an object of each entry: a directory has at most 1 kB for each."""
    end = len(content) - 22  # where zipfile looks first
    if content[end : end + 4] != b"PK\5\6" or content[-2:] != b"\0\0":
        end = content.rfind(b"PK\5\6")
    if end < 0:
        return  # zipfile refuses it
    size = int.from_bytes(content[end + 12 : end + 16], "little")
    if size > 1000 * _MOST_ENTRIES or content[max(end - 20, 0) : end].startswith(b"PK\6\7"):
        raise InputError(f"it has more than {_MOST_ENTRIES} entries", path=path)


class _Entries:
    """The entries of an archive, read within limits."""

    def __init__(self, archive: zipfile.ZipFile, path: str | Path) -> None:
        self._archive = archive
        self._path = path
        self._left = LARGEST_PROJECT
        names = archive.namelist()
        if len(names) > _MOST_ENTRIES:
            raise InputError(f"it has {len(names)} entries, more than {_MOST_ENTRIES}", path=path)
        if _JSON not in names:
            raise InputError(
                f"this is not a project of pretravel: it is an archive without {_JSON}", path=path
            )

    def content(self, name: str, largest: object) -> bytes:
        """An entry; what its header says of its size is not believed."""
        if type(largest) is not int or largest < 0:  # of a negative number zipfile reads all
            raise PretravelError(
                f"this project is damaged: the size of {name} is not a number of bytes"
            )
        if name not in self._archive.NameToInfo:
            raise InputError(f"this project is damaged: it has no entry {name}", path=self._path)
        most = min(largest, self._left)
        with self._archive.open(name) as entry:
            content = entry.read(most + 1)
        if len(content) > most:
            raise InputError(
                f"the entry {name} is larger than its stated size, or the project has more than "
                f"{LARGEST_PROJECT // 10**6} MB",
                path=self._path,
            )
        self._left -= len(content)
        return content


def _stated(entries: _Entries, path: str | Path) -> dict[str, Any]:
    """What the project says of itself, without its files."""
    try:
        stated = parsed_json(entries.content(_JSON, _LARGEST_JSON))
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(f"{_JSON} in it cannot be used: {error}", path=path) from error
    except ValueError as error:
        raise InputError(f"{_JSON} in it is not JSON", path=path) from error
    if not isinstance(stated, dict) or stated.get("format") != _FORMAT:
        raise InputError("this is not a project of pretravel", path=path)
    if stated.get("version") != _VERSION:
        raise InputError(
            f"the project has version {ascii(stated.get('version'))[:20]}, and this pretravel "
            f"reads version {_VERSION}: use a newer pretravel",
            path=path,
        )
    return stated


def _project(entries: _Entries, path: str | Path) -> Project:
    stated = _stated(entries, path)
    try:
        return _checked(stated, entries)
    except PretravelError as error:
        raise InputError(str(error), path=path) from error
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{_JSON} in it is not as pretravel writes it", path=path) from error


def _checked(stated: Mapping[str, Any], entries: _Entries) -> Project:
    identity = str(stated["identity"])
    if not re.fullmatch(r"[0-9a-f]{16}", identity):
        raise PretravelError("its identity is not 16 hexadecimal digits")
    name = " ".join(str(stated["name"]).encode(errors="replace").decode().split())[:100]
    project = Project(name or "Untitled", identity)
    for name in OF_ALL_SCREENS:
        if name in stated.get("shared", {}):
            project.shared[name] = stated["shared"][name]
    for name, content in stated["screens"].items():
        state = project.screen(_checked_name(name))
        settings: Mapping[str, SettingValue] = content["settings"]
        for setting, value in settings.items():
            if setting in OF_ALL_SCREENS and isinstance(value, dict):
                # In projects of earlier versions each screen had its own: they are put together.
                stored = state.settings.get(setting)
                value = value | (stored if isinstance(stored, dict) else {})
            state.settings[str(setting)] = value
        for purpose, files in content["files"].items():
            folder = f"files/{name}/{_checked_name(purpose)}"
            for file in files:
                check_file_name(file["name"])
            state.files[purpose] = tuple(
                StoredFile(file["name"], entries.content(f"{folder}/{file['name']}", file["size"]))
                for file in files
            )
            if len({file.name for file in state.files[purpose]}) < len(state.files[purpose]):
                raise PretravelError(f"two files of '{purpose}' have the same name")
        for input_name, link in content.get("links", {}).items():
            state.links[_checked_name(input_name)] = _checked_link(link)
    return project


def _checked_link(stated: Mapping[str, Any]) -> Link:
    """Where a file comes from; earlier versions stated no links."""
    link = Link(**stated)
    _checked_name(link.screen)
    if not all(isinstance(value, str) and len(value) <= 200 for value in vars(link).values()):
        raise PretravelError("a link in it is not text")
    return link


def _checked_name(name: str) -> str:
    if not _NAME.fullmatch(name):
        raise PretravelError(f"the name {name[:60]!r} of a screen or a purpose cannot be used")
    return name
