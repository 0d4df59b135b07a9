"""The workbench: the jobs of pretravel as a local page in the browser (NiceGUI).

A screen is a function ``show(state)`` in the folder of its task, listed with its place in
``SCREENS`` of ``app/screens.py``. It builds the page for one tab; it keeps nothing
itself. What the user typed and dropped is in `state` (`project.ScreenState`), which is saved, and
shared by all tabs; what is computed belongs to a `jobs.Job`, which runs once for all tabs, off
the event loop. So a reload, a second tab and a new start show the same. The settings are those of
a task (`pretravel.task.listed`): fields, commands and Python lines are made from that. ::

    from pretravel.app.components.document_view import document_screen
    from pretravel.app.components.downloads import result_button
    from pretravel.app.components.file_drop import file_drop
    from pretravel.app.components.layout import live, panel, screen_places
    from pretravel.app.components.outcome import kept, work_status
    from pretravel.app.components.same_elsewhere import same_elsewhere
    from pretravel.app.components.task_fields import described_fields
    from pretravel.app.jobs import Job, Work
    from pretravel.app.project import Inputs, ScreenState
    from pretravel.app.task_form import TaskForm, with_file_names
    from pretravel.tasks.qualify import Qualify

    QUALIFY_FORM = TaskForm(Qualify)      # which settings, and how they are stored

    def qualify_inputs(inputs: Inputs):
        touches, = inputs.files["touches"]
        task = Qualify(touches=(touches,), **QUALIFY_FORM.given(inputs.settings))
        return task.run(), with_file_names(task, output="map.json")

    QUALIFICATION = Job(                  # a constant of the module, with a name of its own
        "qualify",
        compute=qualify_inputs,           # (Inputs) -> result, a function of the module
        title="Qualifying",
        settings=QUALIFY_FORM.stored,     # what it uses: it runs again when one changes
        files=("touches",),
        needs=("touches",),               # files without which it does not start
    )

    def show(state: ScreenState) -> None:
        places = screen_places()          # steps; status, answer, picture, tabs: on all screens
        with places.inputs:
            file_drop(state, "touches", "Touches on the sphere", endings=(".csv",))
            with panel("Reference"):
                described_fields(state, QUALIFY_FORM, QUALIFY_FORM.names)
        with places.status:
            work = work_status(state, QUALIFICATION, missing="Drop touches on the left.")
        # The answer on top, the picture, and the tab Details.
        document_screen(places, work, lambda result: result[0].document(), empty="The touches")
        with places.tab("Files"):
            kept(work, lambda: to_keep(work))
            live([work.listen], lambda: same(work), lambda: work.result)

    def to_keep(work: Work) -> None:      # made once: the buttons stay while results come
        result_button(
            work, "Map", "map.json", lambda path, result: result[0].write("output", path)
        )

    def same(work: Work) -> None:         # the command and the Python lines that do the same
        if work.result is not None:
            same_elsewhere(work.result[1])

**State.** ``state.settings`` is a mapping of names to values that JSON can hold;
``state.settings.get("diameter", 25.0)`` reads, ``state.settings["diameter"] = 30.0`` stores, saves
and tells every tab. Values are copies: to change a list, assign the new list.
``state.files["touches"]`` is a tuple of `project.StoredFile` (``name``, ``content``), empty when
there is none; assign a new tuple to change it. Defaults are not stored: the task has them.

``state.files.before("touches")`` are the files that the last change replaced: `file_drop` brings
them back with a click. Fill a screen with an example by `ScreenState.fill` (`example_button` does):
then the user's own files and settings come back, too (`own_data_back`).

**Links.** What a screen takes of another one, a file, the map or the reference, is a copy with a
`project.Link` next to it in ``state.links`` (`from_project`, `take_reference`, `follow_map`). When
the source would be another one now (`links.newer_inputs` compares digests of inputs), every work
that uses the copy is outdated, its results are pale and cannot be taken, and `work_status` offers
the newer one; the start page says so.

**Work.** Never compute in ``show`` or in an event handler: the event loop must not wait. A `Job`
runs in a thread; with ``own_process=True`` in a process that Cancel kills (everything above a
second: finite elements, meshes, STEP): its ``compute`` is then a function of a module, and its
result can be pickled. ``automatic=False`` gives a button instead of a start at each change;
``live=True`` is for work below 0.1 s that follows a slider. The function gets `jobs.Inputs`:
``settings`` and ``files`` (paths of copies with the user's names).
Files that a result leaves on the screen, as a history with today's line, are those of ``keeps``;
they are inputs too, and no change of the run that made them. Those of ``gives`` other screens take,
as links. The verdict of ``report`` stands on
the start page. A `PretravelError` is shown as it is; its message names the user's file. Log
messages of the logger ``pretravel`` (INFO) are shown as stages of progress, and warnings above the
result.

**Components** (``app/components``): ``layout`` (`screen_places`, `panel`, `folded`,
`text`, `note`, `warning`, `live`, `here`), ``fields`` (`number_field`, `slider_field`,
`text_field`, `choice_field`, `switch_field`), ``task_fields`` (`described_field`,
`described_fields`), ``file_drop``, ``outcome`` (`work_status` and `result_place`, or `outcome` for
both in one place; `kept` for buttons of a result; `follow` to change a picture in place),
``document_view`` (`document_screen`, or its parts; `key_figures`, `table_view`), ``plot``,
``downloads``
(`download_button`, `result_button`, `result_folder_button`),
``same_elsewhere``. For what they lack, use ``nicegui.ui``. `here(subscribe, handler)` calls a
handler in this tab at changes until the tab closes; never keep elements of a tab elsewhere.

**Rules of the page.** Text of users and files only by `text`, `note` or ``ui.label``, never by
``ui.html`` or ``ui.markdown``; values of props by ``element.props["name"] = value``, never in a
string. There is no Tailwind: use the classes of ``static/workbench.css``, and add there what is
missing, with its variables of colour (light and dark). Each input has a label, each picture a text,
each target 44 px; headings in order (the page has the h1, `panel` gives h2). Icons: the names of
Material Icons. Numbers that the library gives are shown by ``show.formatting``.

**Tests**: ``tests/browser/test_NAME.py`` with the fixtures ``page`` and ``workbench`` of its
``conftest`` (`opened`, `serious_problems`). ``tools/screenshots.py FOLDER [SCREEN …]`` takes
pictures.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
