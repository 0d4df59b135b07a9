"""Verification: detected changes, refusals, what is stated, the history with several writers."""

from __future__ import annotations

import math
import multiprocessing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import InputError, PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.files.map_file import read_map, write_map
from pretravel.files.probe_history import add_verification, read_history
from pretravel.files.touches_csv import write_touches
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.sectors import SectorBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.qualification.change_causes import Cause
from pretravel.qualification.change_tests import changes_of, touches_and_map
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import Outlier
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.terms_of_days import day_terms
from pretravel.qualification.verification import (
    Verification,
    _gross_warnings,
    touches_beside_map,
    verify,
)
from pretravel.show.chart_files import drawn_figure
from pretravel.show.style import drawn_pixels
from pretravel.tasks.verify.picture import verification_view
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import rows, run
from tests.support.example_maps import example_map
from tests.support.lobed_map import SETUP, UM, N, lobed_map, lobed_touches, moved
from tests.support.pictures import coloured_share
from tests.support.reference_touches import sphere_touches
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


class TestWhatIsSeen:
    def test_size_and_amplitude_apart(self) -> None:
        larger, wider = check(touches(2, size=0.0012)), check(touches(3, scale=1.2))
        assert larger.changed
        assert wider.changed
        for found, size, amplitude in ((larger, 0.0012, 0.0), (wider, 0.0, 0.2)):
            assert found.size.value == pytest.approx(size, abs=3 * found.size.u)
            assert found.amplitude.value == pytest.approx(amplitude, abs=3 * found.amplitude.u)
        # Touches are on one half of the sphere: the fitted centre takes up a part of the change.
        assert 0.0002 < np.mean(larger.differences) < 0.0012
        assert wider.amplitude.u < 0.05

    def test_another_reference_has_another_error(self) -> None:
        """A diameter of the map with u = 5 µm, and a sphere of 20 mm that shows it: by 2.5 µm."""
        made, new = old_map(), touches(5, size=0.0025)
        setup = replace(made.provenance.setup, u_diameter=0.005)  # type: ignore[type-var]
        made = replace(made, provenance=replace(made.provenance, setup=setup))
        there = replace(new, positions=new.positions - 2.5 * PATTERN)
        for on, diameter, changed in ((new, 25.0, True), (there, 20.0, False)):
            found = verify(on, made, diameter)
            assert found.changed is changed
            assert any("on a sphere of 20 mm" in said for said in found.warnings) is not changed
        assert found.size.u == pytest.approx(0.0025, rel=0.02)  # 5 µm / 2, and 0.1 µm of noise
        # The change is of the probe on the same sphere, and of the diameters on another.
        assert update_map(new, made, 25.0).level.value == pytest.approx(0.0025, abs=0.4e-3)
        assert abs(update_map(there, made, 20.0).level.value) < 0.4e-3

    @pytest.mark.parametrize("angle", [8.0, -8.0, 20.0])
    def test_turn_with_its_sign(self, angle: float) -> None:
        """Positive: the probe is mounted further counter-clockwise than when it was qualified.

        One answer: the slope of lobes of 120° tells 12° of a turn of 20°, the likely cause 20°.
        """
        result = check(touches(4, rotation_deg=angle))
        assert result.changed
        # First order in the angle, on lobes of 120°: an error of a fifth at 8°.
        assert result.turn.value / DEGREE == pytest.approx(angle, abs=2.5)
        turned = [each for each in result.causes if each.name == Cause.TURNED]
        if angle == 20.0:
            assert result.turn.value == turned[0].value

    def test_five_directions_tell_less_but_nothing_wrong(self) -> None:
        few = np.concatenate([np.arange(REPEATS) + REPEATS * k for k in (0, 17, 19, 21, 23)])
        result = check(touches(21).take(few))
        assert not result.changed
        assert result.p_form > 0.01
        assert result.turn.detectable == np.inf
        assert check(touches(21, size=0.004).take(few)).changed


class TestRefused:
    def test_feed_not_told_is_warned_of(self) -> None:
        assert "do not give their feed" in check(touches(1, feed=None)).warnings[0]
        resting = replace(old_map(), feed=None)
        told = [verify(touches(1, feed=feed), resting, 25.0).warnings for feed in (50.0, None)]
        assert ["the map does not state the feed" in " ".join(said) for said in told] == [
            True,
            False,
        ]

    def test_predicted_map(self) -> None:
        probe = load_probe("omp40-2-100mm")
        guess = predicted_map(probe, predict(probe, sphere_pattern_25()))
        with pytest.raises(PretravelError, match="has no uncertainty"):
            verify(touches(1), guess, 25.0)

    def test_a_table_of_a_map(self, tmp_path: Path) -> None:
        """It has no digests: the touches that made the map could verify it."""
        path = tmp_path / "map.csv"
        write_map(path, old_map())
        table = read_map(path)
        for refused in (
            lambda: verify(touches(1), table, 25.0),
            lambda: update_map(touches(1), table, 25.0),
        ):
            with pytest.raises(PretravelError, match="neither the reference nor the touches"):
                refused()

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


# What a verification states: against its tests, of a map with few terms.


TILT = probe_rotation((0.48, 0.6, 0.64), rotation=0.7)


def test_a_verification_states_what_its_tests_found() -> None:
    given, made = lobed_touches(5), lobed_map()
    found = verify(given, made, 25.0, false_alarm_rate=0.03)
    observation = observe(given, SETUP, made.rotation)
    beside = touches_and_map(observation, made, 0.0)
    tests = changes_of(beside, 0.03)
    for name in ("changed", "false_alarm_rate", "p_form", "p_map", "p_repeatability", "size",
                 "amplitude", "turn", "largest"):  # fmt: skip
        assert getattr(found, name) == getattr(tests, name)
    assert found.differences == pytest.approx(tests.differences)
    assert found.u_differences == pytest.approx(np.sqrt(np.diag(beside.covariance)))
    assert found.directions == pytest.approx(N, abs=1e-3)
    repeats = beside.scatter_of_touches
    assert (found.repeatability, found.repeatability_dof) == (repeats.deviation, repeats.dof)
    assert (found.step, found.touches, found.gross, found.warnings) == (0.0, 75, (), ())
    assert (found.causes, found.changed_with_gross) == ((), False)
    single = verify(lobed_touches(2, N), made, 25.0)
    assert np.isnan(single.repeatability)
    assert single.repeatability_dof == 0.0


def _pole_and_equator(count: int) -> np.ndarray:
    azimuth = np.arange(count) * 2.0 * np.pi / count + 0.3
    equator = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(count)], axis=1)
    return np.concatenate([[[0.0, 0.0, 1.0]], equator])


def test_a_turn_that_four_azimuths_cannot_show_is_no_unchanged_probe(tmp_path: Path) -> None:
    """Touches of a probe turned by half a lobe: at every 90° three lobes are a shifted centre.

    With eight azimuths the same turn is found, and the size beside it is not given: the map's
    slope, of which size and amplitude are taken, does not reach over half a lobe.
    """
    write_map(tmp_path / "map.json", lobed_map())
    common = "--map", tmp_path / "map.json", "--diameter", 25
    for count, seen in ((4, False), (8, True)):
        normals = _pole_and_equator(count)
        given = lobed_touches(3, normals)
        still = verify(given, lobed_map(), 25.0)
        assert not still.changed
        assert (still.unseen_turn is None) is seen
        distance = lobed_touches(3, normals @ probe_rotation(rotation=-60.0 * DEGREE))
        radius = np.linalg.norm(distance.positions - [5.0, -7.0, 9.0], axis=1)
        turned = replace(given, positions=normals * radius[:, None] + [5.0, -7.0, 9.0])
        write_touches(tmp_path / "turned.csv", turned)
        assert (day_terms(turned, lobed_map(), SETUP).unseen_turn is None) is seen
        history = tmp_path / f"probe{count}.jsonl"
        report = tmp_path / f"report{count}.json"
        out = "--history", history, "-o", report
        told = " ".join(run("verify", tmp_path / "turned.csv", *common, *out, code=3).split())
        (entry,) = read_history(history)
        assert entry["unseen_turn_deg"] == (None if seen else pytest.approx(60.0))
        assert ('"unseen_turn_deg"' in history.read_text()) is not seen
        for text in (report.read_text(), run("history", history)):
            assert ("TURN OF THE PROBE" in " ".join(text.split())) is not seen
        assert told.startswith(
            "CHANGED" if seen else "no change found since the qualification, BUT"
        )
        assert ("size, amplitude cannot be determined after so large a turn" in told) is seen
        if still.unseen_turn is not None:
            angle, change = still.unseen_turn.angle, still.unseen_turn.change
            assert angle == pytest.approx(60.0 * DEGREE)
            lobes = 2.0 * math.hypot(1.5, 0.8) * math.sqrt(35.0 / 8.0) * UM
            assert change == pytest.approx(lobes, rel=0.05)


@pytest.mark.parametrize(("polar", "unseen"), [(30.0, True), (85.0, False)])
def test_a_change_of_size_that_a_cap_cannot_show(
    tmp_path: Path, polar: float, unseen: bool
) -> None:
    """Touches of a log that breaks off: 10 µm more in all directions are a shift of the centre."""
    old, n = example_map("physical"), fibonacci_cap(9, np.radians(polar))
    write_map(tmp_path / "map.json", old)
    write_touches(tmp_path / "t.csv", sphere_touches(old.pretravel(n), n, radius=24.9987 / 2.0))
    found = verify(tmp_path / "t.csv", old, 24.9987)
    assert not found.changed
    assert found.size_is_unseen is unseen
    code = 3 if unseen else 0
    told = run("verify", tmp_path / "t.csv", "--map", tmp_path / "map.json", "--diameter", 24.9987,
               code=code)  # fmt: skip
    assert ("BUT A CHANGE OF SIZE CANNOT BE SEEN" in " ".join(told.split())) is unseen


def test_a_turn_of_a_map_without_lobes_needs_no_azimuths() -> None:
    flat = lobed_map(coefficients=np.array([10.0, -2.0, 0.05, 0.0]) * UM)
    normals = _pole_and_equator(4)
    distance = 15.5 - flat.pretravel(normals)
    assert verify(Touches(normals * distance[:, None], normals), flat, 25.0).unseen_turn is None


@pytest.mark.parametrize(("step", "matters"), [(1.0, True), (0.1, True), (0.05, False)])
def test_a_step_matters_from_three_tenths_of_the_repeatability(step: float, matters: bool) -> None:
    given = lobed_touches(2)
    coarse = replace(given, positions=np.round(given.positions / (step * UM)) * (step * UM))
    found = verify(coarse, lobed_map(), 25.0)
    assert found.step == pytest.approx(step * UM if matters else 0.0)


@pytest.mark.parametrize(("bad", "left_out"), [(7, 7), (8, 0)])
def test_a_tenth_of_the_touches_at_most_is_left_out(bad: int, left_out: int) -> None:
    rows = [3 * direction for direction in range(4, 4 + bad)]
    given = moved(lobed_touches(2), rows, 0.05)
    beside = touches_beside_map(given, lobed_map(), 25.0)
    assert sorted(row for one in beside.gross for row in one.rows) == rows[:left_out]
    assert len(beside.kept.observation.values) == 75 - left_out
    assert len(beside.all.observation.values) == 75


def test_what_gross_touches_do_to_the_verdict_is_said() -> None:
    one = Outlier((3,), 0.02, 0.001, "t4 lies off")
    assert _gross_warnings((), True, False) == []
    assert _gross_warnings((one,), True, True) == [
        "t4 lies off. It was left out", "the verdict is the same with this touch"]  # fmt: skip
    assert (
        _gross_warnings((one, one), False, False)[2] == "the verdict is the same with these touches"
    )
    assert _gross_warnings((one,), False, True)[1] == (
        "without this touch the verdict is: no change; with: changed. Touch there again"
    )
    assert _gross_warnings((one, one), True, False)[2].startswith(
        "without these touches the verdict is: ch"
    )


@pytest.mark.parametrize("feed", [49.4, 49.6, 50.4, 50.6])
def test_a_hundredth_is_the_same_feed(feed: float) -> None:
    given = replace(lobed_touches(5), feeds=np.full(75, feed))
    made = lobed_map(feed=50.0)
    if abs(feed - 50.0) < 0.5:
        assert verify(given, made, 25.0).warnings == ()
    else:
        with pytest.raises(PretravelError, match=f"made at 50 mm/min, these touches at {feed}: "):
            verify(given, made, 25.0)


def test_of_nine_touches_one_may_be_left_out() -> None:
    """A tenth of them is less than one."""
    n = fibonacci_cap(9, 1.5)
    made = lobed_map()
    noise = 0.3 * UM * np.random.default_rng(1).standard_normal(9)
    distance = 15.5 - made.basis.value(n, made.coefficients) + noise
    distance[4] += 0.1
    given = Touches(n * distance[:, None], n)
    beside = touches_beside_map(given, made, 25.0)
    assert [one.rows for one in beside.gross] == [(4,)]
    assert len(beside.kept.differences) == 8
    assert len(beside.all.differences) == 9


def test_a_ring_is_verified_in_its_plane() -> None:
    """A map that is larger by 3 µm in all directions: on a ring on a tilted probe, wherever it is
    touched along its axis."""
    made = lobed_map(
        rotation=TILT, repeatability=0.2 * UM, covariance=Covariance.independent([1e-12] * 4)
    )
    azimuth = np.repeat(np.arange(24) * (2.0 * np.pi / 24), 2)
    n = np.column_stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth])
    noise = 0.2 * UM * np.random.default_rng(4).standard_normal(48)
    distance = 9.5 + made.basis.value(n, made.coefficients) + 3.0 * UM + noise
    place = -n * distance[:, None] + np.linspace(0.0, 2.0, 48)[:, None] * [0.0, 0.0, 1.0]
    given = Touches(place @ TILT.T + [1.0, 2.0, 3.0], n @ TILT.T)
    found = verify(given, made, 25.0, ring=True)
    assert found.changed
    assert found.size.value == pytest.approx(3.0 * UM, abs=4.0 * 0.2 * UM / math.sqrt(48.0))
    assert found.directions == pytest.approx(n[::2], abs=1e-3)
    same = verify(replace(given, positions=given.positions + 3.0 * UM * given.normals), made, 25.0,
                  ring=True)  # fmt: skip
    assert not same.changed


# The history.


def _write(path: Path, result: Verification, count: int, hour: int = 8) -> None:
    """Verifications of one day, a minute apart."""
    for minute in range(count):
        add_verification(
            path,
            result,
            pretravel_map=old_map(),
            map_name="m.json",
            touches_name="t.csv",
            decision="kept",
            time=datetime(2026, 1, 1, hour, minute, tzinfo=UTC),
        )


class TestHistory:
    @pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
    def test_two_writers_at_once_lose_nothing(self, tmp_path: Path) -> None:
        path = tmp_path / "probe.jsonl"
        result = check(touches(1))
        context = multiprocessing.get_context("fork")
        writers = [context.Process(target=_write, args=(path, result, 15, hour)) for hour in (8, 9)]
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

    @pytest.mark.long
    def test_the_chart_leaves_room_for_the_colour_bar(self, tmp_path: Path) -> None:
        """No two of the six axes of the picture (with their labels) overlap.

        They are where matplotlib's two measures place them, to 2 % of the picture: as near as looks
        the same.
        """
        path = tmp_path / "probe.jsonl"
        result = check(touches(1))
        _write(path, result, 3)
        figure, same = (
            drawn_figure(verification_view(result, read_history(path))) for _ in range(2)
        )
        drawn_pixels(figure)
        same.draw_without_rendering()
        assert [axes.get_position().bounds for axes in figure.axes] == [
            pytest.approx(axes.get_position().bounds, abs=0.02) for axes in same.axes
        ]
        boxes = [axes.get_tightbbox() for axes in figure.axes]
        assert len(boxes) == 6
        for one, two in combinations(boxes, 2):
            assert one is not None
            assert two is not None
            assert not one.overlaps(two)

    def test_other_files_are_left_alone(self, tmp_path: Path) -> None:
        result = check(touches(1))
        text, other = tmp_path / "a.jsonl", tmp_path / "b.jsonl"
        text.write_text("this is not a history at all, whatever its ending says")
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

    @pytest.mark.long
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
        given = ("--history", probe, "--accept", tmp_path / "new.json", "-o", tmp_path / "v.json")
        told = run("verify", tmp_path / "bent.csv", *common, *given, code=3)
        assert "made from these 75 touches alone" in told
        (found,) = data_of(tmp_path / "v.json")["Verification"]
        assert (found["changed"], found["decision"]) == (1.0, "accepted new.json")
        assert found["size_um"] == pytest.approx(2.0, abs=4.0 * found["u_size_um"])
        write_touches(tmp_path / "next.csv", touches(13, size=0.002))
        run("verify", tmp_path / "next.csv", "--map", tmp_path / "new.json", "--diameter", 25)
        told = run("history", probe, "-o", tmp_path / "h.csv", "--plot", tmp_path / "h.png")
        assert "new.json; the history continues with it" in told
        assert [row["changed"] for row in rows(tmp_path / "h.csv")] == ["0", "1"]
        assert coloured_share(tmp_path / "h.png") > 0.001
        assert "must be .jsonl" in run(
            "verify", tmp_path / "same.csv", *common, "--history", tmp_path / "h.txt", code=2
        )
