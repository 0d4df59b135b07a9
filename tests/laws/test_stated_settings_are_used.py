"""Law of all tasks in all their modes: a setting that is accepted is looked at.

What a mode does not use is refused where the task is made (`Field.only`, `Field.without`). Each run
here is of one mode; what it accepts is read by it, or it refuses the value.
"""

from __future__ import annotations

import dataclasses
import shlex
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import MISSING
from pathlib import Path
from typing import Any

import pytest

from pretravel.base.errors import PretravelError
from pretravel.cli.derived import command_of, task_of
from pretravel.laboratory.tasks.check.screen_work import example_touches
from pretravel.task import task as machinery
from pretravel.task.listed import PLACES, task_named
from pretravel.task.task import Setting, Task, settings_of, unused
from tests.support.commands import follow
from tests.support.examples import EXAMPLES
from tests.support.task_samples import samples

pytestmark = pytest.mark.long  # each mode of each task is run

MADE = """\
pretravel qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --kind harmonic -o map.json
pretravel qualify star_touches.csv --diameter 25 --tip down=4 --tip right=4@-1,0,0 --tip left=4@1,0,0 --kind mean -o star.json
pretravel compensate bore_touches.csv --map map.json -o points.csv
pretravel plan-touches --map map.json --count 9 -o few.csv
pretravel simulate map.json --surface sphere:radius=12.49935 --targets few.csv --noise 0.2 --seed 1 -o nine.csv
pretravel verify nine.csv --map map.json --diameter 24.9987 --history probe.jsonl
pretravel align bracket_touches.csv --part bracket.step --map map.json -o place.json
pretravel plan part.step --spacing 20 --margin 4 -o plan.csv
pretravel laboratory > lab.toml
pretravel machine -o mill.toml
"""  # noqa: E501
FEATURES = """\
[[feature]]
kind = "bore"
select = "bore1*"
tolerance = "19.99..20.02"
[[feature]]
kind = "bore"
select = "bore2*"
"""
RUNS = """\
qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --kind mean -o m.json
qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --kind wozniak -o m.json
qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --kind harmonic -o m.json
qualify sphere_touches.csv --unknown-size --tip-diameter 6 --kind mean -o m.json
qualify nine.csv --diameter 24.9987 --prior map.json -o m.json
qualify block_touches.csv --block 25.4,50.8,76.2 --tip-diameter 6 -o m.csv
qualify block_touches.csv --reference block=block:50.8 --tip-diameter 6 -o m.csv
qualify star_touches.csv --diameter 25 --tip down=4 --tip right=4@-1,0,0 --tip left=4@1,0,0 --kind wozniak -o s.json
qualify sphere_touches.csv --diameter 24.9987 --plan few.csv --kind mean
qualify iso230-10.csv --diameter 25 --tip-diameter 6 --pin --kind mean
verify nine.csv --map map.json --diameter 24.9987
history probe.jsonl -o h.csv
history logs --diameter 24.9987 --tip-diameter 6 --kind harmonic -o h.csv
history logs --diameter 24.9987 --map map.json --plan few.csv -o h.csv
plan-touches --map map.json -o t.csv
plan-touches --block 25.4,50.8,76.2 -o t.csv
check-budget sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --kind mean --sets 20 --bore-touches 4 -o b.csv
repeat heights.csv --units mm -o r.csv
align bracket_touches.csv --part bracket.step --map map.json -o p.json
align bracket_touches.csv --part bracket.step --tip-diameter 6 -o p.json
compensate bore_touches.csv --map map.json -o p.csv
compensate nine.csv --map map.json --nominal sphere:radius=12.49935 -o p.json
compensate bore_touches.csv --map omp40-2 --place 1,2,3,0,0,10 --frame part -o p.json
compensate star_bore_touches.csv --map star.json -o p.json
measure points.csv --feature bore --select "bore1*" -o f.csv
measure points.csv --drawing features.toml -o f.csv
axis axis_touches.csv --axis C -o a.csv
compare map.json -o c.csv
compare map.json --for fanuc -o c.csv
compare omp40-2 -o c.csv
compare omp40-2 omp40-2-100mm -o c.csv
reversal reversal_touches.csv -o r.csv
faces part.step -o f.csv
drawing part.step -o d.toml
plan part.step#1 --grid 5x5 -o t.csv
plan bracket.step --drawing faces.toml -o t.csv
export map.json --to csv -o e.csv
export map.json --to linuxcnc -o e
export map.json --to fanuc -o e
export map.json --to siemens -o e
export map.json --to renishaw -o e.nc
export map.json --to radii -o e.json
export map.json --to heidenhain -o e.3DTC
export map.json --to heidenhain --show-template
machine
machine --tools tool.tbl --tool 1
program sphere mill.toml --diameter 24.9987 -o p.ngc
program sphere mill.toml --diameter 24.9987 --pattern iso10360-5 --spindle 0 -o p.ngc
program axis mill.toml --axis C --angles 0,90,180 --diameter 24.9987 --center 30,0,0 --about 0,0,0 -o p.ngc
program axis mill.toml --axis A --angles=-20,0,20 --diameter 24.9987 --center 0,0,0 --about 0,0,-50 -o p.ngc
program part mill.toml plan.csv -o p.ngc
program mdi -o e
probes
probes omp40-2
predict omp40-2 --azimuth 0:350:30 --polar 60 -o m.csv
predict omp40-2 --azimuth 0:350:30 --polar 60 --model shen -o m.csv
simulate omp40-2 --surface sphere:radius=12.5 --targets few.csv -o t.csv
simulate omp40-2 --surface sphere:radius=12.5 --targets few.csv --model shen --noise 0.2 --seed 1 -o t.csv
simulate map.json --surface sphere:radius=12.5 --targets few.csv --place 1,2,3,0,0,10 --frame part -o t.csv
slide omp40-2 --surface plane:polar=40 --at 0.5,0.5 --steps 5 -o s.csv
slide omp40-2 --surface plane:polar=40 --at 0.5,0.5 --steps 5 --process inclined --model shen -o s.csv
hysteresis omp40-2 --model rigid --azimuth 0 --steps 10 --cycles 1 -o c.csv
identify map.json --probe omp40-2 -o i.toml
orientation map.json --probe omp40-2 --axis 0,1,0 -o t.json
studies
wishes
rig rig -o r.csv
rig rig --map m.json --tip-diameter 6 --u-temperature 0.1 --u-expansion 1 -o r.csv
laboratory
separate redundancy_24x24.csv -o s.csv
separate redundancy_24x24.csv --repeat-variance 0.8 --repeat-pair 1,1 -o s.csv
separation-plan --u-systematic 0.2 -o s.csv
check iso10360-5 iso10360-5.csv --diameter 25 --tip-diameter 6 -o c.csv
check iso230-10 iso230-10.csv --diameter 25 --tip-diameter 6 -o c.csv
check iso230-10-tip-offset iso230-10-tip-offset.csv --diameter 25 -o c.csv
pattern iso10360-5 --diameter 25 -o t.csv
convert bore_touches.csv
convert bore_touches.csv -o t.csv
convert cmm_listing.txt --features -o t.csv
convert cmm_listing.txt --radius-taken-off 3 --bore HOLE1 -o t.csv
bundle sphere_touches.csv --diameter 25 -o b.zip
formats
""".splitlines()  # noqa: E501
NO_RUN = {
    "demo": "it has no modes, and takes long",
    "report": "it has no modes, and takes long",
    "fem": "it has no modes, and takes long",
    "study": "a study takes long; its results need a run",
    "design": "it has no modes, and takes long",
}
_OF_THE_MACHINE = ("verbose",)
"""What the command line itself uses, as the outputs that are written afterwards."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """With what the runs read."""
    place = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        shutil.copytree(EXAMPLES, place, dirs_exist_ok=True)
        patch.chdir(place)
        for line in MADE.splitlines():
            follow(line)
        (place / "features.toml").write_text(FEATURES)
        faces = "[[feature]]\nfaces = [3]\nform_tolerance_mm = 0.02\n"
        (place / "faces.toml").write_text(faces)
        (place / "tool.tbl").write_text("T1 P1 D6.0 Z50.0 ;probe\n")
        heights = "".join(f"{0.001 * (i % 3):.3f}\n" for i in range(12))
        (place / "heights.csv").write_text("z\n" + heights)
        (place / "logs").mkdir()
        for day in (1, 2):
            name = f"logs/sphere_2026-03-0{day}.csv"
            (place / name).write_bytes((place / "sphere_touches.csv").read_bytes())
        for standard in ("iso10360-5", "iso230-10", "iso230-10-tip-offset"):
            (place / f"{standard}.csv").write_bytes(example_touches(standard)[1])
        yield place


def made(line: str) -> Task:
    """The task of a command."""
    words = shlex.split(line)
    named = [name for name in PLACES if words[: len(name.split())] == name.split()]
    (name,) = named
    kind = task_named(name)
    given = command_of(kind).make_context(name, words[len(name.split()) :])
    return task_of(kind, given.params)


def accepted(task: Task) -> list[Setting]:
    """The settings that can be stated beside those of a run, apart from its outputs."""
    kind = type(task)
    return [
        setting
        for setting in settings_of(kind)
        if not unused(kind, setting.name, vars(task))[0]
        if not (setting.field.writes and not setting.field.in_run)
        if setting.name not in _OF_THE_MACHINE
        if setting.default is not MISSING  # else it must be stated
    ]


def do(task: Task) -> None:
    """Run a task, make its report and write its values."""
    result = task.run()
    result.document()
    for setting, path in task.written_files():
        if not (setting.field.in_run or setting.is_report(path)):
            result.write(setting.name, path)


@contextmanager
def recorded(task: Task) -> Iterator[set[str]]:
    """The settings of a task that are read within, by itself or by a copy with the same value."""
    kind, own, seen = type(task), dict(vars(task)), set[str]()
    copying = {machinery.__file__, dataclasses.__file__}

    def reading(self: Task, name: str) -> Any:
        value = object.__getattribute__(self, name)
        used = name in own and sys._getframe(1).f_code.co_filename not in copying
        copied = used and value is own[name] and value is not defaults[name]
        if used and (self is task or copied):
            seen.add(name)
        return value

    defaults = {setting.name: setting.default for setting in settings_of(kind)}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kind, "__getattribute__", reading)
        yield seen


@pytest.mark.parametrize("line", RUNS)
def test_what_a_mode_accepts_is_looked_at(line: str, folder: Path) -> None:
    del folder
    task = made(line)
    with recorded(task) as seen:
        do(task)
    never = [setting for setting in accepted(task) if setting.name not in seen]
    for setting in never:
        value = {setting.name: samples(setting)[-1]}
        try:
            stated: Task = dataclasses.replace(task, **value)  # type: ignore[type-var]
            with recorded(stated) as seen:
                do(stated)
        except PretravelError:
            continue
        assert setting.name in seen, f"{setting.option} is accepted, and nothing looks at it"


def test_every_mode_is_run(folder: Path) -> None:
    """Of each condition on a setting there is a run where it holds, and one where it does not."""
    del folder  # some modes are those of files
    tasks = [made(line) for line in RUNS]
    assert {type(task).name for task in tasks} | set(NO_RUN) == set(PLACES)
    found: dict[tuple[Any, ...], set[bool]] = {}
    for task in tasks:
        kind = type(task)
        for setting in settings_of(kind):
            modes = (*setting.field.only, *setting.field.without)
            if modes and kind.inherited_without.get(setting.name) != ():
                # What several tasks share is run with one of them.
                keys = (setting.name, *(m if isinstance(m, str) else m.key for m in modes))
                used = not unused(kind, setting.name, vars(task))[0]
                found.setdefault(keys, set()).add(used)
    assert {keys: used for keys, used in found.items() if len(used) < 2} == {}
