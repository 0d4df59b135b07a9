"""What the description of a task says, in the words of a page: fields and tasks by their names."""

from __future__ import annotations

import re

from pretravel.task import GROUPS, Task, settings_of

_SHORT = {"fem": "FEM", "mdi": "MDI"}
_NAMES = "|".join(sorted((name for names in GROUPS.values() for name in names), key=len)[::-1])
_COMMAND = re.compile(
    rf"'?\bpretravel ({_NAMES})\b(?P<named> NAME)?((?: --[a-z-]+)?(?: [A-Z]{{3,}})?(?: --[a-z-]+ "
    r"[\w.]*\w)?(?: > [\w.]*\w)?)'?"
)
_REPEATED = re.compile(r"Repeat the option for each \w+: ((?:--[a-z-]+ [^\s]*\w\s?)+)")


def title_of(name: str) -> str:
    """The heading of a task: the command's name.

    >>> title_of("plan-touches"), title_of("program mdi")
    ('Plan touches', 'Program MDI')
    """
    words = name.replace("-", " ").split()
    title = " ".join(_SHORT.get(word, word) for word in words)
    return title[0].upper() + title[1:]


def page_words(kind: type[Task], words: str) -> str:
    """What is said of a command, as a page says it: fields by their labels, no exit codes.

    >>> from pretravel.task import task_named
    >>> verify = task_named("verify")
    >>> page_words(verify, "Kept unless --accept names one. Exit code 3: yes.")
    'Kept unless “Accept” names one.'
    >>> page_words(verify, "From pretravel machine > mill.toml. Not with maps (--map).")
    'From “Machine”. Not with maps.'
    """
    sentences = re.split(r"(?<=[.;:]) (?=[A-Z])", words)
    kept = " ".join(one for one in sentences if not one.startswith("Exit code"))
    kept = re.sub(r" \((?:--[a-z-]+|[A-Z]{4,})\)", "", kept)
    kept = _REPEATED.sub(lambda found: f"Several: {_without_options(found[1])}", kept)
    labels = {setting.option: setting.label for setting in settings_of(kind)}
    labels |= {s.name.upper(): s.label for s in settings_of(kind) if s.field.positional}

    def task(found: re.Match[str]) -> str:
        option = found[3].strip()
        if found[1] == kind.name and option in labels:
            return f"“{labels[option]}”"
        return f"“{title_of(found[1])}”{' with a name' if found['named'] else ''}"

    return re.sub(
        r"--[a-z-]+|(?<=[Ww]ith )[A-Z]{4,}\b",
        lambda found: f"“{labels[found[0]]}”" if found[0] in labels else found[0].lower(),
        _COMMAND.sub(task, kept),
    )


def _without_options(words: str) -> str:
    return re.sub(r"--[a-z-]+ ", "", words)
