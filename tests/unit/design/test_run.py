"""Studies that are interrupted, refused or fail in part lose nothing and say why."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.toml_file import parse_toml
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.design.studies.definition import Study, study_in
from pretravel.design.studies.journal import Journal, journal_path
from pretravel.design.studies.outputs import Outcome
from pretravel.design.studies.packed_outcome import packed
from pretravel.design.studies.plan import Plan
from pretravel.design.studies.results_file import read_results
from pretravel.design.studies.run import Workers, blocks_of, digest_of, run_study
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict

TEXT = """
[study]
plan = "full-factorial"
[directions]
azimuth_deg = "0:345:15"
polar_deg = "30:90:20"
[[factor]]
key = "spring.preload_N"
range = [4.0, 8.0]
levels = {count}
[[factor]]
key = "stylus.2.material"
values = ["ceramic", "tungsten carbide"]
"""
ALONE = Workers(count=1)


def study(count: int = 3, more: str = "") -> Study:
    return study_in(parse_toml(TEXT.format(count=count) + more, "study.toml"))


def command(folder: Path, count: int, *arguments: str) -> list[str]:
    (folder / "study.toml").write_text(TEXT.format(count=count))
    return [sys.executable, "-m", "pretravel", "study", "study.toml", "-o", "study.nc",
            "--workers", "1", *arguments]  # fmt: skip


def test_results_are_those_of_predict(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    results = run_study(study(), tmp_path / "study.nc", ALONE)
    with xarray.open_dataset(tmp_path / "study.nc", engine="h5netcdf") as dataset:
        design = dataset.sel(polar=70.0, azimuth=45.0).isel(design=3)
        assert float(design.factor_spring_preload_N) == 6.0
        assert str(design.factor_stylus_2_material.values) == "tungsten carbide"
        probe = load_probe("omp40-2")
        stem = load_probe("omp40-2-100mm-carbide").stem.material
        assert stem.name == "tungsten carbide"
        changed = replace(
            probe, preload=6.0, stylus=(probe.stylus[0], replace(probe.stylus[1], material=stem))
        )
        normal = [np.sin(70 * DEGREE) * np.cos(45 * DEGREE),
                  np.sin(70 * DEGREE) * np.sin(45 * DEGREE), np.cos(70 * DEGREE)]  # fmt: skip
        trigger = predict(changed, [normal])
        assert float(design.trigger_force) == pytest.approx(trigger.force[0], rel=1e-9)
        assert float(design.pretravel) * MICROMETRE == pytest.approx(trigger.pretravel[0], rel=1e-9)
        assert dataset.pretravel.attrs["units"] == "um"
        greatest = dataset.pretravel.max(("polar", "azimuth"))
        np.testing.assert_array_equal(dataset.pretravel_greatest, greatest)
    again = read_results(tmp_path / "study.nc")
    for name, values in results.numbers.items():
        np.testing.assert_array_equal(again.numbers[name], values)
    assert again.factors["stylus.2.material"].tolist() == ["ceramic", "tungsten carbide"] * 3


@pytest.mark.long
def test_a_killed_study_goes_on_and_gives_the_same_file(tmp_path: Path) -> None:
    """SIGKILL, at no chosen moment; the second run computes what is missing."""
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    broken.mkdir()
    run_study(study(150), whole / "study.nc", ALONE)
    process = subprocess.Popen(command(broken, 150), cwd=broken)
    journal = journal_path(broken / "study.nc")
    while process.poll() is None and (not journal.exists() or journal.stat().st_size < 40_000):
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (broken / "study.nc").exists()
    with Journal(journal, digest_of(study(150))) as opened:
        assert 0 < len(opened.done()) < 300
    subprocess.run(command(broken, 150), cwd=broken, check=True, stdout=subprocess.DEVNULL)
    assert (broken / "study.nc").read_bytes() == (whole / "study.nc").read_bytes()
    assert not journal.exists()


@pytest.mark.long
def test_a_full_disk_is_said_and_what_was_done_is_kept(tmp_path: Path) -> None:
    """A limit of the size of files stands for the disk."""
    limit = 60_000

    def limited() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    done = subprocess.run(
        command(tmp_path, 60), cwd=tmp_path, preexec_fn=limited, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "study.nc.journal cannot be written" in done.stderr
    assert "run the command again" in done.stderr
    assert "Traceback" not in done.stderr
    with Journal(journal_path(tmp_path / "study.nc"), digest_of(study(60))) as opened:
        assert 0 < len(opened.done()) < 120
    subprocess.run(command(tmp_path, 60), cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    assert len(read_results(tmp_path / "study.nc")) == 120


@pytest.mark.long
def test_two_runs_on_one_output_are_refused(tmp_path: Path) -> None:
    with Journal(journal_path(tmp_path / "study.nc"), digest_of(study())):
        done = subprocess.run(command(tmp_path, 3), cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert "another process runs a study with this output" in done.stderr


def test_the_journal_of_another_study_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "study.nc"
    with Journal(journal_path(path), digest_of(study(4))) as journal:
        journal.add([(0, packed(Outcome({"pretravel_range": 1.0})))])
    with pytest.raises(PretravelError, match="results of another study"):
        run_study(study(3), path, ALONE)
    run_study(study(3), path, ALONE, restart=True)
    assert len(read_results(path)) == 6


@pytest.mark.long
def test_a_restart_takes_nothing_from_a_study_that_runs(tmp_path: Path) -> None:
    path = journal_path(tmp_path / "study.nc")
    with Journal(path, digest_of(study())) as journal:
        journal.add([(0, packed(Outcome({"pretravel_range": 1.0})))])
        done = subprocess.run(
            command(tmp_path, 3, "--restart"), cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 2
        assert "another process runs a study with this output" in done.stderr
        assert journal.done() == {0}
    with Journal(path, digest_of(study())) as journal:
        assert journal.done() == {0}


def test_a_journal_holds_what_was_put_in(tmp_path: Path) -> None:
    shape = (2, 3)
    values = [np.random.default_rng(i).normal(size=shape) for i in range(3)]
    numbers = {"pretravel_range": 0.1 + 0.2, "pretravel_lobes": float("nan")}
    with Journal(tmp_path / "a.journal", "digest") as journal:
        done, failed = Outcome(numbers, *values), Outcome({}, reason="no probe")
        journal.add([(7, packed(done)), (3, packed(failed))])
        (third, without), (seventh, kept) = journal.outcomes()
    assert (third, without.reason, without.force, seventh) == (3, "no probe", None, 7)
    assert kept.numbers["pretravel_range"] == 0.1 + 0.2
    assert np.isnan(kept.numbers["pretravel_lobes"])
    for stored, value in zip(
        (kept.force, kept.sensing_distance, kept.pretravel), values, strict=True
    ):
        np.testing.assert_array_equal(stored, value)


def test_a_file_that_is_no_journal_is_refused(tmp_path: Path) -> None:
    journal_path(tmp_path / "study.nc").write_text("a text, not a journal, " * 100)
    with pytest.raises(PretravelError, match="not a journal of a study"):
        run_study(study(), tmp_path / "study.nc", ALONE)
    run_study(study(), tmp_path / "study.nc", ALONE, restart=True)
    assert len(read_results(tmp_path / "study.nc")) == 6


def test_a_block_is_kept_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full within the second of two designs."""
    one, write = packed(Outcome({})), os.write
    room = [len(one) + 150]

    def written(descriptor: int, content: bytes) -> int:
        if not room[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        count = write(descriptor, content[: room[0]])
        room[0] -= count
        return count

    with Journal(tmp_path / "a.journal", "digest") as journal:
        journal.add([(3, one)])
        monkeypatch.setattr(os, "write", written)
        with pytest.raises(PretravelError, match="cannot be written: No space left"):
            journal.add([(1, one), (2, one)])
        assert journal.done() == {3}
    with Journal(tmp_path / "a.journal", "digest") as journal:
        assert journal.done() == {3}


@pytest.mark.parametrize("change", ["cut", "another byte", "zeros"])
def test_what_a_crash_left_is_computed_again(tmp_path: Path, change: str) -> None:
    path = tmp_path / "a.journal"
    with Journal(path, "digest") as journal:
        for number in (1, 2):
            journal.add([(number, packed(Outcome({"pretravel_range": 0.1})))])
    whole = path.read_bytes()
    last = {"cut": whole[:-3], "another byte": whole[:-3] + b"#" + whole[-2:],
            "zeros": whole[:-100] + bytes(100)}[change]  # fmt: skip
    path.write_bytes(last)
    with Journal(path, "digest") as journal:
        assert journal.done() == {1}
        journal.add([(2, packed(Outcome({"pretravel_range": 0.1})))])
    assert path.read_bytes() == whole


def test_a_link_beside_an_output_replaces_no_file(tmp_path: Path) -> None:
    """Where others can write to the folder, the journal's name can be a link of theirs."""
    letters, path = tmp_path / "letters.txt", tmp_path / "a.journal"
    path.symlink_to(letters)
    with pytest.raises(PretravelError, match="cannot be opened or made"):
        Journal(path, "digest")
    assert not letters.exists()
    letters.write_text("dear reader")
    with pytest.raises(PretravelError, match="not a journal of a study"):
        Journal(path, "digest")
    with Journal(path, "digest", anew=True):
        assert path.is_file()
    assert letters.read_text() == "dear reader"


def test_a_design_that_cannot_be_is_recorded_with_its_reason(tmp_path: Path) -> None:
    more = '[[factor]]\nkey = "tip.radius_mm"\nvalues = [3.0, 1.0]\n'
    results = run_study(study(2, more), tmp_path / "study.nc", ALONE)
    assert [bool(reason) for reason in results.reasons] == [False, True] * 4
    assert "smaller than the stem" in results.reasons[1]
    assert np.isnan(results.numbers["pretravel_range"][1::2]).all()
    assert np.isfinite(results.numbers["pretravel_range"][::2]).all()
    assert read_results(tmp_path / "study.nc").reasons == results.reasons


def test_targets_that_a_factor_names_are_part_of_the_digest(tmp_path: Path) -> None:
    text = '[study]\noutputs = ["touch"]\n[[factor]]\nkey = "touch.targets"\nvalues = ["a.csv"]\n'
    targets, seen = tmp_path / "a.csv", set()
    for normal in ("0,0,1", "0.6,0,0.8"):
        targets.write_text(f"nx,ny,nz\n{normal}\n")
        seen.add(digest_of(study_in(parse_toml(text, "study.toml"), tmp_path)))
    assert len(seen) == 2


def test_every_setting_is_part_of_the_digest() -> None:
    same = digest_of(study())
    assert digest_of(study()) == same
    others = [
        study(4),
        study(more='[prediction]\nmodel = "shen"\n'),
        *(
            study_in(
                parse_toml(
                    TEXT.format(count=3).replace("[study]", '[study]\noutputs=["calibration"]')
                    + f"[calibration]\ntouches = {touches}\n"
                )
            )
            for touches in (9, 10)
        ),
        study_in(parse_toml(TEXT.format(count=3).replace("0:345:15", "0:330:30"))),
        study_in(parse_toml(TEXT.format(count=3).replace("[study]", '[study]\noutputs=["force"]'))),
        *(
            study_in(
                parse_toml(
                    TEXT.replace("levels = {count}\n", "").replace(
                        '"full-factorial"', f'"latin-hypercube"\nseed = {seed}'
                    )
                )
            )
            for seed in (1, 2)
        ),
        study_in(
            parse_toml(TEXT.format(count=3).replace("[study]", '[study]\nprobe="omp40-2-100mm"'))
        ),
    ]
    assert len({same, *map(digest_of, others)}) == 1 + len(others)


def test_designs_with_the_same_finite_elements_are_computed_together() -> None:
    """Preload changes no mesh; the material of the stem does."""
    one = study(4, '[prediction]\nmodel = "fem"\n')
    blocks = list(blocks_of(Plan(one), range(8), 1))
    assert blocks == [[0, 2, 4, 6], [1, 3, 5, 7]]
    plain = study(4)
    assert list(blocks_of(Plan(plain), range(8), 3)) == [[0, 1, 2], [3, 4, 5], [6, 7]]


def test_without_dask_the_advice_is_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(PretravelError, match=r'pip install "pretravel\[scale\]"'):
        run_study(study(), tmp_path / "study.nc", Workers(count=2))


@pytest.mark.slow
def test_a_scheduler_that_is_not_there(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(PretravelError, match="no scheduler answers at tcp://127"):
        run_study(study(), tmp_path / "study.nc", Workers(scheduler="tcp://127.0.0.1:1"))
