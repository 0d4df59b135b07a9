"""tools/check_release.py notices what is wrong with a package; check-all runs the whole of it."""

from __future__ import annotations

import io
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from tools import check_release
from tools.check_release import (
    IN_SOURCE,
    IN_WHEEL,
    ReleaseError,
    Trials,
    check_content,
    check_source,
    run,
)

METADATA = f"License-Expression: MIT\nRequires-Python: {check_release.PROJECT['requires-python']}\n"


def _wheel(folder: Path, *names: str, metadata: str = METADATA) -> Path:
    path = folder / "pretravel-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as wheel:
        for name in names:
            wheel.writestr(name, "")
        wheel.writestr("pretravel-1.0.dist-info/METADATA", metadata)
    return path


def test_a_whole_wheel(tmp_path: Path) -> None:
    check_content(_wheel(tmp_path, *IN_WHEEL))


@pytest.mark.parametrize("lost", IN_WHEEL)
def test_a_lost_file_is_noticed(tmp_path: Path, lost: str) -> None:
    with pytest.raises(ReleaseError, match=lost):
        check_content(_wheel(tmp_path, *(name for name in IN_WHEEL if name != lost)))


@pytest.mark.parametrize("lost", ["", *IN_SOURCE])
def test_a_source_distribution_has_the_built_site(tmp_path: Path, lost: str) -> None:
    path = tmp_path / "pretravel-1.0.tar.gz"
    with tarfile.open(path, "w:gz") as source:
        for name in IN_SOURCE:
            if name != lost:
                source.addfile(tarfile.TarInfo(f"pretravel-1.0/{name}"), io.BytesIO())
    if not lost:
        check_source(path)
        return
    with pytest.raises(ReleaseError, match=lost):
        check_source(path)


def test_files_that_do_not_belong_there_are_noticed(tmp_path: Path) -> None:
    with pytest.raises(ReleaseError, match=r"too much: \['tests/test_a.py'\]"):
        check_content(_wheel(tmp_path, *IN_WHEEL, "tests/test_a.py"))


def test_other_metadata_are_noticed(tmp_path: Path) -> None:
    with pytest.raises(ReleaseError, match="License-Expression"):
        check_content(_wheel(tmp_path, *IN_WHEEL, metadata="Requires-Python: >=3.11"))


def test_files_that_a_wheel_needs_are_in_the_checkout() -> None:
    """Else a renamed file would make every wheel wrong."""
    places = {"pretravel/example_data": "examples/data", "pretravel": "src/pretravel"}
    for name in IN_WHEEL:
        begin = next(each for each in places if name.startswith(each))
        assert (check_release.ROOT / (places[begin] + name.removeprefix(begin))).exists()


def test_each_extra_has_a_trial() -> None:
    extras = set(check_release.PROJECT["optional-dependencies"])
    assert set(check_release.EXTRAS) == extras - {check_release.ALL}


def test_a_failure_is_counted_and_the_others_go_on() -> None:
    def broken() -> None:
        raise ReleaseError("no demo")

    trials = Trials()
    assert not trials.run("demo", broken)
    assert trials.run("help", lambda: None)
    assert trials.failed == ["demo"]


def test_a_program_that_fails_is_shown_with_what_it_said(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "import sys; print('why'); sys.exit(3)"]
    with pytest.raises(ReleaseError, match=r"ended with 3\nwhy"):
        run(command, tmp_path)
    assert run(command, tmp_path, codes=(3,)) == "why\n"


def test_wrong_and_missing_findings_of_a_type_checker_are_told() -> None:
    with pytest.raises(ReleaseError, match=r"wrongly found \[\('a.py', 1\)\].*\('b.py', 2\)"):
        check_release._compare("mypy", [("a.py", 1)], "b.py", {2})
    check_release._compare("mypy", [("b.py", 2), ("b.py", 2)], "b.py", {2})


def test_every_mistake_is_marked() -> None:
    text = (check_release.ROOT / "tests/release/users_mistakes.py").read_text("utf-8")
    functions, marks = text.count("\ndef "), text.count("  # mistake\n")
    assert functions == marks == 4


def test_the_interpreter_of_these_tests_is_found_where_pyenv_keeps_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without uv's answer: a folder as pyenv makes it."""
    place = tmp_path / "versions" / "3.99.1" / "bin" / "python"
    place.parent.mkdir(parents=True)
    place.touch()
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path))
    monkeypatch.setattr(check_release.subprocess, "run", lambda *_, **__: _Answer())
    assert check_release.interpreter("3.99") == str(place)
    assert check_release.interpreter("3.98") is None


class _Answer:
    returncode, stdout = 2, ""
