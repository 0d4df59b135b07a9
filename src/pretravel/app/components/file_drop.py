"""A place to drop files, or to choose them with the keyboard; the server limits their size."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nicegui import ui

from pretravel.app.components.layout import folded_until_opened, live, text
from pretravel.app.jobs import WORKS
from pretravel.app.project import ScreenState, StoredFile
from pretravel.app.recognised import not_this
from pretravel.app.session import SESSION
from pretravel.app.uploads import UPLOADS, Slot

_MEGABYTE = 1_000_000
_REPLACED = ("touches",)
"""Purposes whose files replace those of before, where several may be given together."""


def file_drop(
    state: ScreenState,
    purpose: str,
    label: str,
    *,
    endings: Sequence[str] = (),
    several: bool = False,
    limit: int = 100 * _MEGABYTE,
    hint: str = "",
) -> None:
    """A place for the files of a purpose, with a list of those that are there.

    Parameters
    ----------
    state : ScreenState
    purpose : str
        The files come to ``state.files[purpose]``.
    label : str
        What to drop, for example "Touches on the sphere".
    endings : sequence of str
        Of the names, such as ".csv"; empty: any.
    several : bool
        Whether several files may be given together. Those that are given later are added; but
        touches replace those of before, which a click brings back: of another day they are
        another question.
    limit : int
        Most bytes of a file.
    hint : str
        Below the label.
    """
    project = SESSION.project.identity
    UPLOADS.add(
        project, Slot(state, purpose, tuple(endings), several, limit, purpose not in _REPLACED)
    )
    with ui.element("div").classes("file-drop"):
        with ui.element("label"):
            ui.icon("upload_file").props('aria-hidden="true"')
            text("span", label, "file-drop-label")
            text("span", hint or _allowed(endings, limit), "file-drop-hint")
            chooser = ui.element("input").props('type="file"').classes("file-drop-input")
            chooser.props["data-url"] = f"/upload/{project}/{state.name}/{purpose}"
            chooser.props["accept"] = ",".join(endings)
            chooser.props["data-limit"] = limit
            if several:
                chooser.props["multiple"] = True
        ui.element("p").classes("file-drop-status").props('role="status"')
        live([state.listen], lambda: _list(state, purpose), lambda: state.files[purpose])
        live(
            [state.listen],
            lambda: _doubts(state, purpose),
            lambda: (state.files[purpose], _is_used(state, purpose)),
        )
        live(
            [state.listen],
            lambda: _way_back(state, purpose, several),
            lambda: (state.files[purpose], state.files.before(purpose)),
        )


def _is_used(state: ScreenState, purpose: str) -> bool:
    """Whether work with the file was started: it says itself what is wrong with it."""
    works = WORKS.made(state)
    return any(work.ready() for work in works if purpose in (*work.job.files, *work.job.needs))


def _doubts(state: ScreenState, purpose: str) -> None:
    """What is wrong with a file that waits for others."""
    for file in () if _is_used(state, purpose) else state.files[purpose]:
        if said := not_this(file.name, file.content, purpose):
            text("p", said, "file-drop-status problem").props('role="status"')


def _way_back(state: ScreenState, purpose: str, several: bool) -> None:
    """What the last change replaced, and the buttons that bring it back."""
    now, before = state.files[purpose], state.files.before(purpose)
    if not before:
        return
    names = before[0].name + (f" and {len(before) - 1} more" if len(before) > 1 else "")

    def put(files: tuple[StoredFile, ...]) -> Callable[[], None]:
        def change() -> None:
            state.files[purpose] = files

        return change

    with ui.element("div").classes("way-back"):
        text("span", f"{now[0].name} replaced {names}." if now else f"{names}: removed.")
        ui.button("Take it back", icon="undo", on_click=put(before)).props("no-caps flat dense")
        if several and now:
            by_name = {file.name: file for file in (*before, *now)}
            both = put(tuple(by_name.values()))
            ui.button("Use all together", on_click=both).props("no-caps flat dense")


def _allowed(endings: Sequence[str], limit: int) -> str:
    kinds = f"{', '.join(endings)}; " if endings else ""
    return f"Drop or choose a file ({kinds}up to {_size_text(limit)})"


_MOST_LINES = 4
"""Files that are listed; more are a line that opens."""


def _list(state: ScreenState, purpose: str) -> None:
    files = state.files[purpose]
    if len(files) <= _MOST_LINES:
        _lines(state, purpose)
        return
    size = _size_text(sum(len(file.content) for file in files))

    def remove_all() -> None:
        state.files[purpose] = ()

    with ui.element("div").classes("many-files"):
        folded_until_opened(f"{len(files)} files, {size}", lambda: _lines(state, purpose))
        button = ui.button(icon="close", on_click=remove_all).props("flat round")
        button.props["aria-label"] = "Remove all files"


def _lines(state: ScreenState, purpose: str) -> None:
    with ui.element("ul").classes("file-list"):
        for file in state.files[purpose]:
            with ui.element("li"):
                text("span", file.name, "file-name")
                text("span", _size_text(len(file.content)), "file-size")

                def remove(gone: object = file) -> None:
                    state.files[purpose] = tuple(f for f in state.files[purpose] if f is not gone)

                button = ui.button(icon="close", on_click=remove).props("flat round")
                button.props["aria-label"] = f"Remove {file.name}"


def _size_text(size: int) -> str:
    """A size in bytes as text.

    >>> _size_text(900), _size_text(12_400), _size_text(2_500_000)
    ('900 bytes', '12 kB', '2.5 MB')
    """
    if size < 1000:
        return f"{size} bytes"
    return f"{size / 1e3:.0f} kB" if size < 1e6 else f"{size / 1e6:.3g} MB"
