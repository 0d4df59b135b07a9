"""A short run of the driver, and that it notices what it is for."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest

from tests.hard.interrupted_writes import COMMANDS, Folder, try_command

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals and mounts of Linux")
BY_NAME = {command.name: command for command in COMMANDS}


@pytest.mark.parametrize(
    "name", ["pattern", pytest.param("program mdi", marks=pytest.mark.slow), "convert"]
)
def test_the_old_file_or_the_new_one_and_no_litter(name: str) -> None:
    outcome = try_command(BY_NAME[name], moments=16)
    assert outcome.broken == []


def test_a_command_that_writes_in_place_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def in_place(path: Path, columns: object) -> None:
        with Path(path).open("w") as file:
            for _ in range(3000):
                file.write("1,2,3\n")
                file.flush()

    folder = Folder(BY_NAME["pattern"])
    monkeypatch.setattr("pretravel.files.write_csv_table", in_place)
    folder.run()
    folder.new = {name: (folder.path / name).read_bytes() for name in folder.outputs}
    wrong = [folder.disturb("full disk", random.Random(seed)) for seed in range(5)]
    assert any("pattern.csv" in words for words in wrong)
