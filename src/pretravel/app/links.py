"""Links of a project: an input of a screen that another screen has or makes.

A screen keeps a copy of what it takes, so that its result stays what it is. The link next to
the copy says of what it is a copy: as soon as the other screen has or would make something else,
whatever depends on the copy is old (`Work.newer`), until the user takes the new one or keeps his.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Protocol

from pretravel.app.project import Link, ScreenState, SettingValue
from pretravel.app.screens import SCREENS
from pretravel.base import object_at


class Uses(Protocol):
    """What a job computes from; see `jobs.Job`."""

    @property
    def name(self) -> str:
        """Of the job."""

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of settings."""

    @property
    def files(self) -> tuple[str, ...]:
        """Purposes of files."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Those without which it does not start."""

    @property
    def after(self) -> tuple[Uses, ...]:
        """Jobs before it."""


REFERENCE = ("diameter", "u_diameter_um", "sphere_form_um", "ring", "tip_diameter")
"""Of the reference and the tip; called alike by all tasks that ask for a reference."""
OF_TASK = "task-"
"""Begins the names of the screens of tasks."""
_JOB_OF_TASK = "pretravel.app.every_task:job_of_screen_of_task"
OF_REFERENCE = "reference"
"""The name of their link."""


def digest_of(values: SettingValue) -> str:
    """Of what JSON can hold.

    >>> digest_of({"a": 1, "b": 2}) == digest_of({"b": 2, "a": 1})
    True
    """
    text = json.dumps(values, sort_keys=True, ensure_ascii=False)
    return hashlib.blake2b(text.encode()).hexdigest()[:32]


def inputs_digest(state: ScreenState, job: Uses) -> str:
    """Of all that a job computes from: its settings and files, and those of jobs before it."""
    settings, files = state.settings, state.files
    return digest_of(
        [
            {name: settings[name] for name in job.settings if name in settings},
            {
                purpose: [file.digest for file in files[purpose]]
                for purpose in dict.fromkeys((*job.files, *job.needs))
            },
            [inputs_digest(state, before) for before in job.after],
        ]
    )


def reference_of(settings: Mapping[str, SettingValue]) -> dict[str, SettingValue]:
    """What a screen states about reference and tip."""
    return {name: settings[name] for name in REFERENCE if name in settings}


def job_of_screen(screen: str, name: str) -> Uses | None:
    """A job whose result other screens take; `name` is a place of `Link`."""
    name = name.partition(":")[0]
    if screen.startswith(OF_TASK):
        of_task: Uses | None = object_at(_JOB_OF_TASK)(screen)
        return of_task
    for each in SCREENS:
        if each.name == screen:
            jobs: Iterable[Uses] = map(object_at, each.jobs)
            return next((job for job in jobs if job.name == name), None)
    return None


def link_of_file(source: ScreenState, purpose: str, digest: str) -> Link:
    """A link to a file of another screen."""
    return Link(source.name, "file", purpose, digest, digest)


def link_of_result(source: ScreenState, job: Uses, taken: str, file: str = "") -> Link:
    """A link to what a job of another screen makes; `taken` is the digest of the file.

    `file` is its name among those that the job gives (`Job.gives`).
    """
    place = f"{job.name}:{file}" if file else job.name
    return Link(source.name, "result", place, inputs_digest(source, job), taken)


def link_of_reference(source: ScreenState) -> Link:
    """A link to reference and tip of another screen."""
    digest = digest_of(reference_of(source.settings))
    return Link(source.name, "reference", "", digest, digest)


def newer_inputs(state: ScreenState) -> dict[str, Link]:
    """The links of a screen whose source is not what was taken any more, by their names."""
    return {
        name: link
        for name, link in state.links.items()
        if holds(state, name, link) and _source_now(state, link) not in ("", link.of_source)
    }


def holds(state: ScreenState, name: str, link: Link) -> bool:
    """Whether the screen still has what it took."""
    if link.kind == "reference":
        return digest_of(reference_of(state.settings)) == link.taken
    return [file.digest for file in state.files[name]] == [link.taken]


def _source_now(state: ScreenState, link: Link) -> str:
    """Digest of the source as it is; empty where there is none any more."""
    if state.project is None:
        return ""
    source = state.project.screen(link.screen)
    if link.kind == "reference":
        found = reference_of(source.settings)
        return digest_of(found) if found.get("diameter") is not None else ""
    if link.kind == "file":
        digests = [file.digest for file in source.files[link.place]]
        return link.of_source if link.of_source in digests else "".join(digests[-1:])
    job = job_of_screen(link.screen, link.place)
    if job is None or not all(source.files[purpose] for purpose in job.needs):
        return ""
    return inputs_digest(source, job)
