"""The part of a project is geometry: nothing of a file that was sent is executed."""

from __future__ import annotations

import math
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from pretravel.app.jobs import Work
from pretravel.app.project import Inputs, Project, ScreenState, StoredFile
from pretravel.base.errors import PretravelError
from pretravel.design.screen.work import start_text
from pretravel.drawing.features.conformity import ConformityVerdict
from pretravel.drawing.screen.part import COMPENSATION
from pretravel.drawing.screen.work import (
    PartResult,
    asks_where,
    compensate_part,
    example_map,
    lacking_for_points,
    measure_face,
    measure_part,
)
from pretravel.prediction.catalogue import description_text
from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES

pytestmark = pytest.mark.long  # a part is placed first


@pytest.mark.parametrize("name", ["evil.py", "evil.py#a.step"])
def test_a_python_file_as_part_is_not_executed(tmp_path: Path, name: str) -> None:
    """A project that somebody sent can contain any file: its endings were not checked at a drop."""
    executed = tmp_path / "executed"
    for place in (name, "evil.py"):
        (tmp_path / place).write_text(f"open({str(executed)!r}, 'w')\nsurface = 1\n")
    files = {"touches": (EXAMPLES / "part_touches.csv",), "part": (tmp_path / name,)}
    with pytest.raises(PretravelError):
        compensate_part(Inputs({"probe": "omp40-2"}, files))
    assert not executed.exists()


def test_a_path_as_a_probe_is_refused(tmp_path: Path) -> None:
    """The field offers the catalogue alone, but a project that was sent can state anything."""
    (tmp_path / "mine.toml").write_text(description_text("omp40-2"), encoding="utf-8")
    state = ScreenState("part")
    state.files["touches"] = (StoredFile("part_touches.csv", b"x_mm"),)
    state.settings["probe"] = str(tmp_path / "mine.toml")
    assert "choose a probe of the catalogue" in lacking_for_points(state)
    assert not Work(COMPENSATION, state).ready()
    state.settings["probe"] = "omp40-2"
    assert Work(COMPENSATION, state).ready()


@pytest.mark.parametrize("name", ["sent", "sent.TOML", "sent.txt", "sent.json.x"])
def test_a_description_is_judged_whatever_its_name(tmp_path: Path, name: str) -> None:
    """A file of a project that has no ending of a map is a description, and of no other file."""
    geometry = '[geometry]\nstep = "/etc/solids.step"\ntripod = "a"\nstylus = "b"\ntip = "c"\n'
    (tmp_path / name).write_text(f"{description_text('omp40-2')}\n{geometry}", encoding="utf-8")
    files = {"touches": (EXAMPLES / "part_touches.csv",), "map": (tmp_path / name,)}
    with pytest.raises(PretravelError, match=r"names the file /etc/solids\.step"):
        compensate_part(Inputs({}, files))


def test_a_netcdf_map_of_an_old_project_is_refused(tmp_path: Path) -> None:
    (tmp_path / "map.nc").write_bytes(b"\x89HDF\r\n\x1a\n")
    files = {"touches": (EXAMPLES / "part_touches.csv",), "map": (tmp_path / "map.nc",)}
    with pytest.raises(PretravelError, match=r"again with -o map\.json"):
        compensate_part(Inputs({}, files))


@pytest.mark.parametrize("step", ["/etc/solids.step", "../../solids.step", "//host/share/a.step"])
def test_a_description_names_no_file_of_this_computer(tmp_path: Path, step: str) -> None:
    geometry = f'[geometry]\nstep = "{step}"\ntripod = "a"\nstylus = "b"\ntip = "c"\n'
    sent = tmp_path / "sent.toml"
    sent.write_text(f"{description_text('omp40-2')}\n{geometry}", encoding="utf-8")
    files = {"touches": (EXAMPLES / "part_touches.csv",), "map": (sent,)}
    with pytest.raises(PretravelError, match=f"names the file {step}"):
        compensate_part(Inputs({}, files))
    with pytest.raises(PretravelError, match=f"names the file {step}"):
        start_text("omp40-2", sent)
    sent.write_text(description_text("omp40-2"), encoding="utf-8")
    assert start_text("omp40-2", sent) == description_text("omp40-2")


@pytest.mark.parametrize("limits", ["..25.1", "24.9..", "24.9..25.1", "", None])
def test_the_command_has_the_limits_that_were_used(limits: str | None) -> None:
    files = {"touches": (EXAMPLES / "part_touches.csv",)}
    result = compensate_part(Inputs({"probe": "omp40-2"}, files))
    settings = {
        "measure_feature": "sphere",
        "measure_size_tolerance": limits,
        "measure_u_machine_um": 1.23456789,
    }
    found = measure_part(result, Inputs(settings, files))
    words = shlex.split(found.same.command_line())
    assert words[words.index("--u-machine") + 1] == "1.23456789"
    assert ("--tolerance" in words) == bool(limits)
    if limits:
        assert words[words.index("--tolerance") + 1] == limits
        low, high = (float(end) if end else None for end in limits.split(".."))
        wanted = (-math.inf if low is None else low, math.inf if high is None else high)
        assert found.made.task.tolerances().size == wanted


@pytest.fixture(scope="module")
def bracket(tmp_path_factory: pytest.TempPathFactory) -> tuple[PartResult, dict[str, tuple[Path]]]:
    """A bracket that lies anywhere, aligned from nothing with a map."""
    name, content = example_map(EXAMPLES)
    made = tmp_path_factory.mktemp("map") / name
    made.write_bytes(content)
    files = {"touches": (EXAMPLES / "bracket_touches.csv",), "part": (EXAMPLES / "bracket.step",)}
    return compensate_part(Inputs({"aligned": True}, files | {"map": (made,)})), files


def test_a_part_that_lies_anywhere_as_on_the_command_line(
    bracket: tuple[PartResult, dict[str, tuple[Path]]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The commands that the screen shows make its points and its placement."""
    result, files = bracket
    for content in files.values():
        shutil.copy(content[0], tmp_path)
    name, content = example_map(EXAMPLES)
    (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)
    result.write_points(tmp_path / "screen.csv")
    for task in result.same:
        run(*shlex.split(task.command_line())[1:])
    mine, theirs = rows(tmp_path / "screen.csv"), rows(tmp_path / "points.csv")
    assert [row["x_mm"] for row in mine] == [row["x_mm"] for row in theirs]
    assert (tmp_path / "machine_points.csv").exists()
    with pytest.raises(PretravelError, match="drop its STEP file"):
        compensate_part(
            Inputs({"probe": "omp40-2", "aligned": True}, {"touches": files["touches"]})
        )


def test_a_face_is_found_and_measured(bracket: tuple[PartResult, dict[str, tuple[Path]]]) -> None:
    """The bore of 12 mm by a click on its wall; the top has no touch of the bottom."""
    result, _ = bracket
    assert result.part is not None
    bore = result.face_at(np.array([12.0 + 6.0, 12.0, 10.0]))
    assert bore is not None
    found = measure_face(result, bore)
    (feature,) = (each.feature for each in found.made.features)
    assert feature.quantity("diameter").value == pytest.approx(12.0, abs=0.01)
    assert len(feature.points) == 8
    assert found.same is not None
    assert found.same.select == ("bore1-*",)
    untouched = sorted(set(range(len(result.part.faces))) - set(result.face.tolist()))  # type: ignore[union-attr]
    with pytest.raises(PretravelError, match="no touch lies on face"):
        measure_face(result, untouched[0])


def test_the_tolerances_of_a_drawing(
    bracket: tuple[PartResult, dict[str, tuple[Path]]], tmp_path: Path
) -> None:
    result, files = bracket
    drawing = tmp_path / "drawing.toml"
    drawing.write_text(
        '[[feature]]\nkind = "cylinder"\nselect = "bore1-*"\ntolerance = "11.95..12.05"\n'
        '[[feature]]\nkind = "cylinder"\nselect = "boss-*"\ntolerance = "14.01..14.02"\n'
    )
    settings = {"measure_probability": 0.975, "measure_feature": "plane"}
    found = measure_part(result, Inputs(settings, files | {"drawing": (drawing,)}))
    verdicts = [each.verdict for each in found.made.features]
    assert verdicts == [ConformityVerdict.CONFORMS, ConformityVerdict.DOES_NOT_CONFORM]
    assert found.made.task.probability == 0.975
    assert "--drawing drawing.toml" in found.same.command_line()


def test_coordinates_alone_wait_for_the_part_and_for_where_it_lies() -> None:
    """They have no normals without the part, and lie elsewhere as a rule: no error, a next step."""
    state = Project("Of a test").screen("part")
    state.settings["probe"] = "omp40-2"

    def put(purpose: str, name: str) -> None:
        state.files[purpose] = (StoredFile(name, (EXAMPLES / name).read_bytes()),)

    put("touches", "bracket_tip_centres.csv")
    assert "the part as a STEP file" in lacking_for_points(state)
    put("part", "bracket_pmi.step")
    assert asks_where(state)
    assert "press “Find the part”" in lacking_for_points(state)
    state.settings["aligned"] = True
    assert lacking_for_points(state) == ""
    state.settings.pop("aligned")
    put("touches", "part_touches.csv")  # with normals
    assert not asks_where(state)
    assert lacking_for_points(state) == ""
