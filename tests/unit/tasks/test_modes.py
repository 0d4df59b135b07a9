"""Settings of one mode of a task are refused in another, in one place and by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import PretravelError
from pretravel.task.task import by_name
from tests.support.commands import run

SPHERE = "sphere.csv --diameter 25 --tip-diameter 6"
REFUSED = """\
measure points.csv --drawing f.toml --tolerance 29..29.1
measure points.csv --drawing f.toml --nominal 20
measure points.csv --drawing f.toml --position-tolerance 0.1
measure points.csv --drawing f.toml --form-tolerance 0.1
measure points.csv --drawing f.toml --select bore1*
measure points.csv --drawing f.toml --group
measure points.csv --drawing f.toml --axis 0,0,1
measure points.csv --drawing f.toml --at 1,2,3
qualify sphere.csv --diameter 25 --prior map.json --u-diameter 5
qualify sphere.csv --diameter 25 --prior map.json --u-temperature 1
qualify sphere.csv --diameter 25 --prior map.json --sphere-form 1
qualify sphere.csv --diameter 25 --prior map.json --axial-pretravel 2
qualify sphere.csv --diameter 25 --prior map.json --lobe-azimuth 30
qualify sphere.csv --diameter 25 --prior map.json --transducer piezo
qualify block.csv --block 50.8 --axis 0,1,0
plan-touches --block 50.8 --count 3
plan-touches --block 50.8 --normals n.csv
plan-touches --block 50.8 --history nofile.jsonl
compare A.toml B.toml --form table
compensate t.csv --map map.json --model shen -o p.csv
convert listing.txt --features --radius-taken-off 3 -o f.csv
simulate omp40-2 --surface convex --targets t.csv --extrapolate -o t.csv
qualify sphere.csv --diameter 25 --join label
check-budget sphere.csv --diameter 25 --prior map.json
""".splitlines()


@pytest.mark.parametrize("line", REFUSED)
def test_a_setting_that_the_mode_does_not_use_is_refused(line: str) -> None:
    """Before any file is read; the message names its option."""
    words = line.split()
    option = [word for word in words if word.startswith("--")][-1]
    if words[-2:] == ["-o", words[-1]]:
        option = [word for word in words[:-2] if word.startswith("--")][-1]
    err = run(*words, code=2)
    assert "leave it out" in err
    assert option in err


@pytest.mark.parametrize("option", ["--radius-taken-off 3", "--offset 1,2,3", "--bore HOLE1"])
def test_what_the_reader_of_a_format_does_not_use_is_refused(option: str, tmp_path: Path) -> None:
    """A table with a radius that was taken off was converted as if nothing had been said."""
    table = tmp_path / "t.csv"
    table.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n")
    for output in (("-o", tmp_path / "u.csv"), ()):
        assert "not used for a file of format csv" in run(
            "convert", table, *option.split(), *output, code=2
        )


def test_help_and_form_say_the_mode(tmp_path: Path) -> None:
    from pretravel.app.task_form import TaskForm
    from pretravel.controls.tasks.compare import Compare
    from pretravel.drawing.tasks.measure import Measure
    from pretravel.tasks.qualify import Qualify

    assert by_name(Measure)["nominal"].help.endswith("Not with --drawing.")
    assert by_name(Compare)["form"].help.endswith("Only with --for.")
    form = TaskForm(Qualify)
    assert "transducer" not in form.used({"kind": "mean"})
    assert form.given({"kind": "mean", "transducer": "piezo"}) == {"kind": "mean"}
    with pytest.raises(PretravelError, match="transducer is only for wozniak or auto"):
        Qualify(touches=tmp_path / "t.csv", diameter=25, kind="mean", transducer="piezo")
