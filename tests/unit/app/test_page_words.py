"""What a page says of a task has no words of the command line."""

import re

from pretravel.app.every_task import summary_of
from pretravel.app.page_words import page_words
from pretravel.app.task_run import tasks_on_screens
from pretravel.task import Task, settings_of, task_named

_TASKS: list[type[Task]] = [
    kind for tasks in tasks_on_screens().values() for kind in tasks.values()
]
_NAMES = "|".join(name for tasks in tasks_on_screens().values() for name in tasks)
_OF_A_COMMAND = re.compile(
    rf"(?<![\w-])--[a-z]|Exit code|Repeat the option|\bpretravel ({_NAMES})\b|> \w"
)


def test_no_summary_and_no_help_names_options_or_commands() -> None:
    said = [summary_of(kind) for kind in _TASKS]
    shown = [
        (kind, each)
        for kind in _TASKS
        for each in settings_of(kind)
        if each.field.in_run or not each.field.writes
    ]
    said += [page_words(kind, each.help) for kind, each in shown]
    assert [words for words in said if _OF_A_COMMAND.search(words)] == []
    assert sum(bool(_OF_A_COMMAND.search(each.help)) for _, each in shown) > 50  # it is looked for


def test_a_command_in_words_that_are_printed_is_the_name_of_its_task() -> None:
    wishes = "pretravel wishes NAME > wish.toml prints a specification to edit."
    assert page_words(task_named("wishes"), wishes) == (
        "“Wishes” with a name prints a specification to edit."
    )
    own = "give it with pretravel verify --history; see pretravel export MAP --to linuxcnc, too"
    assert page_words(task_named("verify"), own) == "give it with “History”; see “Export”, too"
