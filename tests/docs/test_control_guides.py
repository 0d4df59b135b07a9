"""The guides for controls: every command in a fresh folder, every program on an interpreter."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from pretravel.files.map_file import read_map
from pretravel.maps.pretravel_map import PretravelMap
from tests.support.commands import follow, rows
from tests.support.examples import EXAMPLES
from tests.support.macro_b_interpreter import MacroAlarm, MacroControl
from tests.support.siemens_interpreter import SiemensControl

GUIDES = EXAMPLES.parent.parent / "docs" / "how-to"
RING, TIP = 50.0, 3.0
WALLS = {
    "+X": (-1.0, 0.0, 0.0),
    "-X": (1.0, 0.0, 0.0),
    "+Y": (0.0, -1.0, 0.0),
    "-Y": (0.0, 1.0, 0.0),
}


@pytest.fixture(scope="module")
def qualified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder after the commands that all guides begin with."""
    folder = tmp_path_factory.mktemp("qualified")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for command in commands("controls"):
            follow(command)
    return folder


def commands(guide: str) -> list[str]:
    text = (GUIDES / f"{guide}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.S | re.M)
    return [line for block in blocks for line in block.splitlines()]


def program_of(guide: str) -> str:
    text = (GUIDES / f"{guide}.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"^```nc\n(.*?)^```", text, re.S | re.M)
    return str(program)


def followed(
    guide: str,
    folder: Path,
    qualified: Path,
    monkeypatch: pytest.MonkeyPatch,
    *,
    only: str = "",
) -> str:
    """What the commands of a guide print in a fresh folder; qualified only once for all guides.

    `only` chooses the commands for one control where a guide is for two."""
    monkeypatch.chdir(folder)
    shared = set(commands("controls"))
    printed = []
    for command in commands(guide):
        if command in shared:
            for made in re.findall(r"(?:-o |cp \S+ )(\S+)", command):
                shutil.copy(qualified / made, folder / made)
        elif only in command:
            printed.append(follow(command))
    return "\n".join(printed)


def triggers(pretravel_map: PretravelMap) -> dict[str, float]:
    """Where the tip's centre is at the trigger, from the middle of the ring: true for this map."""
    late = {wall: float(pretravel_map.pretravel([n])[0]) for wall, n in WALLS.items()}
    return {wall: 0.5 * RING - TIP + late[wall] for wall in WALLS}


class Ring:
    """A ring around the origin, and the probe of a map in it: moves of a control."""

    def __init__(
        self,
        pretravel_map: PretravelMap,
        *,
        present: int = 99,
        early: tuple[int, float] = (0, 0.0),
    ) -> None:
        self.trigger = triggers(pretravel_map)
        self.present = present
        self.early = early
        self.touches = 0
        self.feed_modes: set[float | None] = set()

    def __call__(self, control: MacroControl, words: list[tuple[str, float]]) -> None:
        motion = [value for letter, value in words if letter == "G" and value in (1.0, 31.0)]
        for axis, letter in enumerate("XY"):
            end = dict(words).get(letter)
            if end is None:
                continue
            wall = ("+" if end > 0 else "-") + letter
            reached = end
            if motion == [31.0]:
                self.touches += 1
                self.feed_modes.add(control.variables[4005])
                early = self.early[1] if self.touches == self.early[0] else 0.0
                if self.touches <= self.present:  # the walls of the first touches
                    reached = np.copysign(self.trigger[wall] - early, end)
                control.variables[5061 + axis] = float(reached)
            control.variables[5041 + axis] = float(reached)


def measured(control: MacroControl) -> list[float]:
    control.variables |= {5041: 0.0, 5042: 0.0, 5061: 0.0, 5062: 0.0}
    control.run(7760, {"D": RING, "R": TIP, "F": 100.0})
    return [control.variables[number] or 0.0 for number in (110, 111, 112, 113)]


STATES = {4001: 0.0, 4003: 91.0, 4005: 95.0, 4006: 20.0, 4109: 1.25}
"""After a tapping cycle in inches; F100 would be 100 a revolution."""


def check_alarms(control: MacroControl, pretravel_map: PretravelMap) -> None:
    """A wall that is missing, a probe that trips early once, cutter compensation."""
    # Touches 5 to 8 are the second pass; 0.6 mm is within the clearance, 1.2 mm is not.
    cases = [(Ring(pretravel_map, present=walls), "105") for walls in (0, 1)]
    cases += [(Ring(pretravel_map, early=(2, 1.2)), "106")]
    cases += [(Ring(pretravel_map, early=(touch, 0.6)), "108") for touch in (5, 6, 7, 8)]
    for move, alarm in cases:
        control.move = move
        control.variables |= STATES
        with pytest.raises(MacroAlarm, match=alarm):
            measured(control)
        assert {key: control.variables[key] for key in STATES} == STATES
        assert move.feed_modes <= {94.0}
    control.variables[4007] = 41.0
    with pytest.raises(MacroAlarm, match="109"):
        measured(control)


MACROS = "fanuc-haas"
"""The guide for two controls, whose macros differ little."""


@pytest.mark.parametrize("table", [False, True])
@pytest.mark.parametrize("name", ["fanuc", "haas"])
def test_macro_guide(
    name: str, *, table: bool, tmp_path: Path, qualified: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    printed = followed(MACROS, tmp_path, qualified, monkeypatch, only=f"--to {name} ")
    pretravel_map = read_map(tmp_path / "map.json")
    control = MacroControl(two_value_atan=name == "fanuc", move=Ring(pretravel_map))
    files = sorted((tmp_path / (f"{name}-table" if table else name)).iterdir())
    assert len(files) == (2 if table else 1)
    for path in files:
        control.load(path.read_text())
    program = program_of(MACROS)
    if name == "haas":  # as the guide says
        program = program.replace("\nIF [", "\nG103 P1\nIF [", 1).replace("\nM99", "\nG103\nM99", 1)
    control.load(program)
    if table:
        control.run(7750)
    errors = re.findall(r"FROM THE MAP ([\d.]+) UM", printed)
    error = float(errors[table]) * 1e-3
    # Two walls, each with the error that the head states.
    control.variables |= STATES
    diameter_x, diameter_y, *centre = measured(control)
    assert {key: control.variables[key] for key in STATES} == STATES
    assert diameter_x == pytest.approx(RING, abs=2.0 * error)
    assert diameter_y == pytest.approx(RING, abs=2.0 * error)
    assert centre == pytest.approx([0.0, 0.0], abs=error)
    # All variables that there are, in the best number of rows: 399 and 299.
    assert error < ({"fanuc": 0.00075, "haas": 0.0009}[name] if table else 1e-5)
    # Without the lookup: as the guide says, too large.
    control.programs[7751] = ["#100=0", "M99"]
    text = (GUIDES / f"{MACROS}.md").read_text(encoding="utf-8")
    plain_x, plain_y, *_ = measured(control)
    assert f"larger by {1e3 * (plain_x - RING):.1f} µm" in text
    assert f"#111 by {1e3 * (plain_y - RING):.1f} µm" in text
    check_alarms(control, pretravel_map)


@pytest.mark.parametrize("table", [False, True])
def test_siemens_guide(
    *, table: bool, tmp_path: Path, qualified: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    printed = followed("siemens", tmp_path, qualified, monkeypatch)
    control = SiemensControl()
    folder = tmp_path / ("siemens-table" if table else "siemens")
    texts = {path.name: path.read_text() for path in folder.iterdir()}
    control.define(texts["PRETRAVEL_GUD.DEF"])
    control.load(texts["PRETRAVEL.SPF"])
    assert ("PRETRAVEL_TABLE.SPF" in texts) is table
    if table:
        control.load(texts["PRETRAVEL_TABLE.SPF"])
        control.run("PRETRAVEL_TABLE")
    at = triggers(read_map(tmp_path / "map.json"))
    given = {1: TIP, 11: at["+X"], 12: -at["-X"], 13: at["+Y"], 14: -at["-Y"]}
    found = control.main(program_of("siemens"), given)
    error = float(re.findall(r"from the map ([\d.]+) um", printed)[table]) * 1e-3
    assert [found[31], found[32]] == pytest.approx([RING, RING], abs=2.0 * error)
    assert [found[33], found[34]] == pytest.approx([0.0, 0.0], abs=error)


def test_numbers_by_hand(qualified: Path) -> None:
    """Those of the page for all controls are those of `radii.csv`."""
    text = (GUIDES / "controls.md").read_text(encoding="utf-8")
    equator = {
        float(row["azimuth_deg"]): float(row["pretravel_um"])
        for row in rows(qualified / "radii.csv")
        if float(row["polar_deg"]) == 90.0
    }
    values = [equator[azimuth] for azimuth in (0.0, 90.0, 180.0, 270.0)]
    assert f"| pretravel/µm | {' | '.join(f'{value:.2f}' for value in values)} |" in text
    assert f"= {values[0] + values[2]:.1f} µm" in text
    assert f"{(values[0] - values[2]) / 2:.1f} µm in X" in text


def test_renishaw_guide(tmp_path: Path, qualified: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    printed = followed("renishaw", tmp_path, qualified, monkeypatch)
    text = (GUIDES / "renishaw.md").read_text(encoding="utf-8")
    right, wrong, touched = re.findall(r"([\d.]+) UM AT MOST", printed)[:3]
    assert f"leaves errors of at most {float(right):.1f} µm" in text
    assert f"{float(wrong):.1f} µm if it is wrong" in text
    assert f"leave {float(touched):.1f} µm" in text
    for name, row in (("O7799.nc", "`O7799.nc` (normals)"), ("travel.nc", "`travel.nc`")):
        control = MacroControl()
        control.load((tmp_path / name).read_text())
        control.run(7799)
        radii = [control.variables[number] or 0.0 for number in range(510, 518)]
        assert f"| {row} | {' | '.join(f'{radius:.4f}' for radius in radii)} |" in text
        smaller = 2.0 * (TIP - (control.variables[500] or 0.0)) * 1e3
        assert f"smaller by {smaller:.1f} µm" in text
