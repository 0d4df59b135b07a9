"""Verification: false alarms, detected changes, and the history with several writers."""

from __future__ import annotations

import multiprocessing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from pretravel.base.directions import ring_pattern, sphere_pattern_25
from pretravel.base.errors import ExtrapolationError, InputError, PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.files.map_file import write_map
from pretravel.files.probe_history import add_verification, read_history
from pretravel.files.touches_csv import write_touches
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.sectors import SectorBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.predict import predict, predicted_map
from pretravel.qualification.qualify import qualify
from pretravel.qualification.verification import Verification, verify
from pretravel.show.chart_files import drawn_figure
from pretravel.tasks.reports.verification_report import verification_view
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import rows, run
from tests.support.pictures import coloured_share
from tests.support.results import data_of

REPEATS = 3
NOISE = 3e-4
PATTERN = np.repeat(sphere_pattern_25(), REPEATS, axis=0)


@cache
def pretravel_of(rotation_deg: float = 0.0) -> np.ndarray:
    # Directions in the frame of a probe that is rotated in the machine.
    seen = PATTERN @ probe_rotation(rotation=rotation_deg * DEGREE)
    return predict(load_probe("omp40-2-100mm"), seen).pretravel


def touches(
    seed: int, *, size: float = 0.0, scale: float = 1.0, rotation_deg: float = 0.0,
    noise: float = NOISE, feed: float | None = 50.0,
) -> Touches:  # fmt: skip
    rng = np.random.default_rng(seed)
    pretravel = pretravel_of(rotation_deg)
    pretravel = pretravel.mean() + scale * (pretravel - pretravel.mean()) + size
    radius = 12.5 + 3.0 - pretravel + noise * rng.standard_normal(len(PATTERN))
    center = rng.uniform(-50.0, 50.0, 3)
    feeds = None if feed is None else np.full(len(PATTERN), feed)
    return Touches(center + PATTERN * radius[:, None], PATTERN, feeds=feeds)


@cache
def old_map(seed: int = 1, kind: str = "harmonic") -> PretravelMap:
    return qualify(touches(seed), 25.0, tip_diameter=6.0, kind=kind).pretravel_map


def check(new: Touches, rate: float = 0.01, seed: int = 1) -> Verification:
    return verify(new, old_map(seed), 25.0, false_alarm_rate=rate)


class TestFalseAlarms:
    @pytest.mark.slow
    def test_no_more_than_stated(self) -> None:
        """Forty qualifications and verifications of an unchanged probe, at 20 %.

        Eight alarms are expected at most; more than 15 come once in 200 trials of this test.
        """
        alarms = 0
        for seed in range(40):
            fresh = qualify(touches(100 + seed), 25.0, tip_diameter=6.0, search_outliers=False)
            result = verify(touches(300 + seed), fresh.pretravel_map, 25.0, false_alarm_rate=0.20)
            alarms += result.changed
        assert alarms <= int(stats.binom.ppf(0.995, 40, 0.20))
        assert alarms >= 1  # a test without any alarm would detect nothing

    def test_repeatability_follows_its_own_law(self) -> None:
        """Fisher's F of the scatter within 25 directions of three touches, by hand, against a map
        whose scatter has 50 degrees of freedom too; nine tenths of the false alarms say larger.
        Tails of real noise are allowed for, so p is not below Fisher's, nor above that of half the
        degrees of freedom."""
        new = touches(500)
        along = np.sum(new.positions * new.normals, axis=1).reshape(25, REPEATS)
        scatter = np.sqrt(np.sum((along - along.mean(axis=1, keepdims=True)) ** 2) / 50.0)

        def by_hand(ratio: float, dof: float) -> float:
            law = stats.f(dof, dof)
            return float(min(law.sf(ratio**2) / 0.9, law.cdf(ratio**2) / 0.1))

        for ratio in (0.6, 0.7, 1.2, 1.4, 1.7):
            old = replace(old_map(), repeatability=scatter / ratio, repeatability_dof=50.0)
            p = verify(new, old, 25.0, false_alarm_rate=0.01).p_repeatability
            assert by_hand(ratio, 50.0) < p < by_hand(ratio, 25.0)


def result_of_turn() -> float:
    return check(touches(13)).turn.u


class TestWhatIsSeen:
    def test_size_with_its_sign(self) -> None:
        result = check(touches(2, size=0.0012))
        assert result.changed
        assert result.size.value == pytest.approx(0.0012, abs=3 * result.size.u)
        assert result.amplitude.value == pytest.approx(0.0, abs=3 * result.amplitude.u)
        # Touches are on one half of the sphere: the fitted centre takes up a part of the change.
        assert 0.0002 < np.mean(result.differences) < 0.0012

    def test_turn_knows_that_the_map_s_own_orientation_is_uncertain(self) -> None:
        """Old and new touches both contribute to the uncertainty of the turn: √2 of either."""
        normals = sphere_pattern_25()
        seen = pretravel_of()[::REPEATS]
        step = 0.5
        slope = (pretravel_of(-step)[::REPEATS] - pretravel_of(step)[::REPEATS]) / (
            2 * step * DEGREE
        )
        design = np.column_stack([normals, np.ones(25), seen - seen.mean(), slope])
        alone = NOISE / np.sqrt(REPEATS) * np.sqrt(np.linalg.inv(design.T @ design)[-1, -1])
        assert result_of_turn() > 1.3 * alone

    def test_amplitude(self) -> None:
        result = check(touches(3, scale=1.2))
        assert result.changed
        assert result.amplitude.value == pytest.approx(0.2, abs=3 * result.amplitude.u)
        assert result.amplitude.u < 0.05

    @pytest.mark.parametrize("angle", [8.0, -8.0])
    def test_turn_with_its_sign(self, angle: float) -> None:
        """Positive: the probe is mounted further counter-clockwise than when it was qualified."""
        result = check(touches(4, rotation_deg=angle))
        assert result.changed
        # First order in the angle, on lobes of 120°: an error of a fifth at 8°.
        assert result.turn.value / DEGREE == pytest.approx(angle, abs=2.5)

    def test_scatter_of_repeats(self) -> None:
        worse = check(touches(5, noise=3 * NOISE))
        assert worse.p_repeatability < 1e-6
        assert worse.changed
        assert worse.repeatability == pytest.approx(3 * NOISE, rel=0.3)
        better = check(touches(5, noise=0.2 * NOISE))
        assert better.p_repeatability < 1e-6

    def test_what_would_be_seen_is_seen(self) -> None:
        """A change of size that is detected in 95 of 100 cases, as stated; 30 times."""
        promised = check(touches(6), rate=0.05).size.detectable
        seen = sum(
            check(touches(700 + seed, size=promised), rate=0.05).changed for seed in range(30)
        )
        # 95 % of 30 is 28.5; 25 or fewer come once in 60.
        assert seen >= 26

    def test_unmoved_sphere_or_not_is_all_the_same(self) -> None:
        here = touches(7)
        there = Touches(
            here.positions + np.array([100.0, -200.0, 50.0]), here.normals, feeds=here.feeds
        )
        assert check(here).p_map == pytest.approx(check(there).p_map, rel=1e-3)

    def test_five_directions_tell_less_but_nothing_wrong(self) -> None:
        few = np.concatenate([np.arange(REPEATS) + REPEATS * k for k in (0, 17, 19, 21, 23)])
        result = check(touches(21).take(few))
        assert not result.changed
        assert result.p_form > 0.01
        assert result.turn.detectable == np.inf
        assert check(touches(21, size=0.004).take(few)).changed

    def test_physical_maps_and_few_directions(self) -> None:
        result = verify(touches(8), old_map(1, "physical"), 25.0)
        assert not result.changed
        few = np.arange(0, 7 * REPEATS)
        assert not verify(touches(9).take(few), old_map(), 25.0).changed


class TestRefused:
    @pytest.mark.parametrize(
        ("new", "words"),
        [
            (touches(1, feed=200.0), "the map was made at 50 mm/min"),
            (touches(1).take(np.arange(4 * REPEATS)), "4 directions are too few"),
        ],
    )
    def test_touches(self, new: Touches, words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            check(new)

    def test_feed_not_told_is_warned_of(self) -> None:
        assert "do not state their feed" in check(touches(1, feed=None)).warnings[0]

    def test_predicted_map(self) -> None:
        probe = load_probe("omp40-2-100mm")
        guess = predicted_map(probe, predict(probe, sphere_pattern_25()))
        with pytest.raises(PretravelError, match="states no uncertainty"):
            verify(touches(1), guess, 25.0)

    @pytest.mark.parametrize("kind", ["mean", "sectors", "wozniak"])
    def test_maps_that_do_not_follow_the_probe(self, kind: str) -> None:
        basis = {"mean": MeanBasis(), "sectors": SectorBasis(), "wozniak": WozniakBasis(0.0)}[kind]
        coarse = replace(
            old_map(), basis=basis, coefficients=np.full(basis.size, 0.01),
            covariance=Covariance.fully_shared(np.full(basis.size, 1e-9)),
        )  # fmt: skip
        with pytest.raises(PretravelError, match=f"kind {kind} does not follow"):
            verify(touches(1), coarse, 25.0)

    @pytest.mark.parametrize("rate", [0.0, 0.5, -1.0, float("nan")])
    def test_rate(self, rate: float) -> None:
        with pytest.raises(PretravelError, match="false-alarm rate"):
            check(touches(1), rate)

    def test_directions_outside_the_map(self) -> None:
        below = ring_pattern(np.array([30.0, 60.0, 90.0, 115.0]) * DEGREE, 12)
        new = Touches(below * 15.49, below, feeds=np.full(len(below), 50.0))
        with pytest.raises(ExtrapolationError):
            check(new)


def _write(path: Path, result: Verification, count: int) -> None:
    for _ in range(count):
        add_verification(
            path,
            result,
            pretravel_map=old_map(),
            map_name="m.json",
            touches_name="t.csv",
            decision="kept",
        )


class TestHistory:
    @pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
    def test_two_writers_at_once_lose_nothing(self, tmp_path: Path) -> None:
        path = tmp_path / "probe.jsonl"
        result = check(touches(1))
        context = multiprocessing.get_context("fork")
        writers = [context.Process(target=_write, args=(path, result, 15)) for _ in range(2)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        assert [writer.exitcode for writer in writers] == [0, 0]
        entries = read_history(path)
        assert sorted(entry.number for entry in entries) == list(range(1, 31))
        # The history is one file, without further files.
        assert [p.name for p in tmp_path.iterdir()] == ["probe.jsonl"]

    def test_oldest_first_with_what_was_found(self, tmp_path: Path) -> None:
        path = tmp_path / "probe.jsonl"
        start = datetime(2026, 1, 1, 8, tzinfo=UTC)
        results = [check(touches(seed, size=0.001 * seed)) for seed in (1, 2)]
        for day, result in ((1, results[1]), (0, results[0])):
            add_verification(
                path, result, pretravel_map=old_map(), map_name="m", touches_name="t",
                decision="kept", time=start + timedelta(days=day),
            )  # fmt: skip
        entries = read_history(path)
        assert [entry["time"] for entry in entries] == [
            "2026-01-01T08:00:00+00:00", "2026-01-02T08:00:00+00:00"]  # fmt: skip
        assert entries[1]["size_um"] == pytest.approx(1e3 * results[1].size.value)
        assert bool(entries[1]["changed"])
        assert entries[1]["turn_deg"] == pytest.approx(results[1].turn.value / DEGREE)

    def test_the_chart_leaves_room_for_the_colour_bar(self, tmp_path: Path) -> None:
        """No two of the six axes of the picture (with their labels) overlap."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        path = tmp_path / "probe.jsonl"
        result = check(touches(1))
        _write(path, result, 3)
        figure = drawn_figure(verification_view(result, read_history(path)))
        FigureCanvasAgg(figure).draw()
        boxes = [axes.get_tightbbox() for axes in figure.axes]
        assert len(boxes) == 6
        for one, two in combinations(boxes, 2):
            assert one is not None
            assert two is not None
            assert not one.overlaps(two)

    def test_other_files_are_left_alone(self, tmp_path: Path) -> None:
        result = check(touches(1))
        text, other = tmp_path / "a.jsonl", tmp_path / "b.jsonl"
        text.write_text("this is no history at all, whatever its ending says")
        other.write_text('{"schema": "another program", "version": 1}\n')
        before = [text.read_bytes(), other.read_bytes()]
        for path in (text, other):
            with pytest.raises(InputError, match=f"{path.name}, line 1: .* not the history"):
                add_verification(
                    path, result, pretravel_map=old_map(), map_name="m", touches_name="t",
                    decision="kept",
                )  # fmt: skip
            with pytest.raises(InputError, match="not the history"):
                read_history(path)
        assert [text.read_bytes(), other.read_bytes()] == before
        with pytest.raises(InputError, match="no such history"):
            read_history(tmp_path / "c.jsonl")

    def test_another_probe_is_refused(self, tmp_path: Path) -> None:
        path, result = tmp_path / "probe.jsonl", check(touches(1))
        told = {"map_name": "m", "touches_name": "t", "decision": "kept"}
        add_verification(path, result, pretravel_map=old_map(), **told)  # type: ignore[arg-type]
        other = replace(old_map(), tip_radius=2.0)
        with pytest.raises(InputError, match="a probe with a tip of 6 mm"):
            add_verification(path, result, pretravel_map=other, **told)  # type: ignore[arg-type]

    def test_touches_of_the_map_itself_are_noticed(self, tmp_path: Path) -> None:
        own = replace(touches(1), source="day.csv")
        fresh = qualify(own, 25.0, tip_diameter=6.0).pretravel_map
        assert "anew" in " ".join(verify(own, fresh, 25.0).warnings)

    def test_commands_from_touches_to_the_chart(self, tmp_path: Path) -> None:
        write_map(tmp_path / "map.json", old_map())
        write_touches(tmp_path / "same.csv", touches(11))
        write_touches(tmp_path / "bent.csv", touches(12, size=0.002))
        probe, common = (
            tmp_path / "probe.jsonl",
            ["--map", tmp_path / "map.json", "--diameter", 25],
        )
        told = run("verify", tmp_path / "same.csv", *common, "--history", probe,
                   "--plot", tmp_path / "v.png")  # fmt: skip
        assert "no change found since" in told
        # Exit code 3 means changed; the message is still on stdout.
        run("verify", tmp_path / "bent.csv", *common, "--history", probe,
            "--accept", tmp_path / "new.json", "-o", tmp_path / "v.json", code=3)  # fmt: skip
        (found,) = data_of(tmp_path / "v.json")["Verification"]
        assert (found["changed"], found["decision"]) == (1.0, "accepted new.json")
        assert found["size_um"] == pytest.approx(2.0, abs=4.0 * found["u_size_um"])
        run("verify", tmp_path / "bent.csv", "--map", tmp_path / "new.json", "--diameter", 25)
        told = run("history", probe, "-o", tmp_path / "h.csv", "--plot", tmp_path / "h.png")
        assert "accepted new.json" in told
        assert [row["changed"] for row in rows(tmp_path / "h.csv")] == ["0", "1"]
        assert coloured_share(tmp_path / "h.png") > 0.001
        assert "must be .jsonl" in run(
            "verify", tmp_path / "same.csv", *common, "--history", tmp_path / "h.txt", code=2
        )
