"""Positions without labels are joined with the plan that was run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import FilePositions
from pretravel.files.logs.joining import join
from pretravel.touches.targets import Targets
from tests.support.commands import rows, run
from tests.support.control_logs import (
    PLAN,
    written,
)


class TestJoin:
    def test_by_the_lines_whatever_the_order(self) -> None:
        seen = np.array([[23.01, 0, -5], [10, 0, 2.98], [0, 0, 2.99], [10, 0, 1.01]])
        found = join(FilePositions("log", seen, (1, 2, 3, 4)), PLAN, 3.0, overtravel=2.0)
        # Ten micrometres before the end of its move, where a control stops without a contact.
        assert found.missed == ("b.2",)
        seen, end = seen[:3], seen[3:] + np.array([0, 0, 0.03])
        assert join(FilePositions("log", end, (1,)), PLAN, 3.0, overtravel=2.0).missed == ()
        found = join(FilePositions("log", seen, (1, 2, 3)), PLAN, 3.0, overtravel=2.0)
        assert found.touches.labels == ("wall", "b.1", "a")
        assert found.touches.normals[0].tolist() == [1.0, 0.0, 0.0]
        assert found.touches.lines == (1, 2, 3)
        # LinuxCNC leaves out a repeat that equals the one before: it is named, not added.
        assert "b.2" in found.notes()[0]

    @pytest.mark.parametrize(
        ("seen", "words"),
        [
            ([[0.0, 0, 2.99], [0, 0.2, 2.99]], "line of any target; the nearest is a, 0.200 mm"),
            ([[0.0, 0, 2.99], [0, 0, 2.98]], "more readings than the plan"),
            ([[0.0, 0, 2.99 * 25.4]], "line of any target"),
        ],
    )
    def test_refused_with_its_line(self, seen: list[list[float]], words: str) -> None:
        lines = tuple(range(1, len(seen) + 1))
        with pytest.raises(InputError, match=words) as caught:
            join(FilePositions("log", np.array(seen), lines), PLAN, 3.0)
        assert f"line {len(seen)}:" in str(caught.value)

    def test_a_stated_miss_can_be_anywhere(self) -> None:
        """grbl reports zeros for a miss, or the end of the move."""
        seen = np.array([[0.0, 0, 2.99], [500, 500, 500], [20.0 + 3 + 9, 0, -5], [10, 0, 2.98]])
        positions = FilePositions("log", seen, (4, 5, 6, 7), (True, False, False, True))
        found = join(positions, PLAN, 3.0)
        assert found.touches.labels == ("a", "b.1")
        assert found.missed == ("wall",)
        assert found.notes()[1].endswith("line of exactly one target: line 5")
        stray = FilePositions("log", seen, (4, 5, 6, 7), (True, True, False, True))
        with pytest.raises(InputError, match=r"line 5: .*line of any target"):
            join(stray, PLAN, 3.0)

    def test_crossing_lines_are_told_apart_or_refused(self) -> None:
        cross = Targets([[0.0, 0, 0], [-3.0, 0, 3.0]], [[0.0, 0, 1], [-1.0, 0, 0]])
        # Both lines pass (0, 0, 3): the first target's contact is there, the second's 6 mm away.
        found = join(FilePositions("log", np.array([[0.0, 0, 2.99]]), (1,)), cross, 3.0)
        assert found.touches.labels == ("1",)
        twins = Targets([[0.0, 0, 0], [-1.0, 0, 3.0]], [[0.0, 0, 1], [-1.0, 0, 0]])
        with pytest.raises(InputError, match="can belong to several targets"):
            join(
                FilePositions("log", np.array([[-2.0, 0, 3.0], [0.0, 0, 3.0]]), (1, 2)), twins, 1.5
            )


class TestByLabel:
    """A part that lies elsewhere, and plans that state one point for each face."""

    MOVED = FilePositions(
        "a.csv",
        np.array([[20.0 + 3.01, 0.4, -5.2], [0.3, 0.2, 2.99], [10.2, 0.1, 2.98]]),
        (2, 3, 4),
        labels=("wall", "a", "b.2"),
    )

    def test_readings_beside_the_lines_are_joined_by_their_labels(self) -> None:
        with pytest.raises(InputError, match="labels are also those of the plan") as caught:
            join(self.MOVED, PLAN, 3.0)
        assert "join" in caught.value.inputs
        found = join(self.MOVED, PLAN, 3.0, by="label")
        assert found.touches.labels == ("wall", "a", "b.2")
        assert found.touches.normals[0].tolist() == [1.0, 0.0, 0.0]
        # In the plane of the target: 10 µm is what lies along the normal.
        assert found.touches.nominal_points is not None
        assert np.allclose(found.touches.nominal_points[0], [20.0, 0.4, -5.2], atol=1e-12)
        assert found.notes()[0].startswith("1 touches of the plan have no reading: b.1")

    def test_points_of_faces(self) -> None:
        """Several points have the name of their face, which the plan states once."""
        faces = Targets(
            [[0.0, 0, 5], [50.0, 0, 0]], [[0.0, 0, 1], [1, 0, 0]], labels=("top", "end")
        )
        seen = np.array([[1.0, 2, 6.01], [7.0, 9, 5.99], [51.002, 3, 4]])
        for labels, told in (
            (("top", "top", "end"), ("top-1", "top-2", "end")),
            (("top-3", "top-4", "end-1"), ("top-3", "top-4", "end-1")),
        ):
            by = "label" if labels[0] == "top" else "feature"
            found = join(FilePositions("a", seen, (1, 2, 3), labels=labels), faces, 1.0, by=by)
            assert found.touches.labels == told
            assert found.touches.normals[2].tolist() == [1.0, 0.0, 0.0]
            assert found.notes() == []
            assert not found.missed

    def test_the_nearest_target_of_a_feature(self) -> None:
        around = np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0]])
        bore = Targets(-10.0 * around, around, labels=("B1", "B2", "B3"))
        seen = -9.0 * around + [0.1, 0.1, 0.3]
        names = ("B-7", "B-8", "B-9")
        found = join(FilePositions("a", seen, (1, 2, 3), labels=names), bore, 1.0, by="feature")
        assert np.allclose(found.touches.normals, around)
        between = FilePositions("a", np.array([[-6.0, -6.0, 0]]), (5,), labels=("B-7",))
        with pytest.raises(InputError, match=r"line 5: .*between several targets"):
            join(between, bore, 1.0, by="feature")

    @pytest.mark.parametrize(
        ("labels", "position", "words"),
        [
            (None, [0.0, 0, 2.99], "no labels to join by"),
            (("c",), [0.0, 0, 2.99], "line 9: the plan has no target called 'c'; it has a, b.1"),
            (("a",), [0.0, 0, 75.0], "line 9: the reading a lies 72.000 mm along"),
        ],
    )
    def test_refused(
        self, labels: tuple[str, ...] | None, position: list[float], words: str
    ) -> None:
        seen = FilePositions("log", np.array([position]), (9,), labels=labels)
        with pytest.raises(InputError, match=words):
            join(seen, PLAN, 3.0, by="label")

    def test_the_columns_of_a_plan_are_stated(self, tmp_path: Path) -> None:
        """Each message names the option that the next call has."""
        plan = written(
            tmp_path, "0;1;0.0;0.0;5.5;0.0;0.0;1.0\n1;1;50.5;0.0;0.0;1.0;0.0;0.0\n", "p.txt"
        )
        log = written(tmp_path, "17;0;1.5;2.5;6.51\n18;0;7.5;9.5;6.49\n19;1;51.502;3.5;4.5\n")
        call: list[object] = ["convert", log, "--units", "mm", "--tip-diameter", 2, "-o",
                              tmp_path / "t.csv", "--plan", plan]  # fmt: skip
        for asked, value in (
            ("--plan-columns", "label=1,x=3,y=4,z=5,nx=6,ny=7,nz=8"),
            ("--columns", "label=2,x=3,y=4,z=5"),
            ("--join", "label"),
        ):
            assert asked in run(*call, code=2)
            call += [asked, value]
        run(*call)
        assert [row["label"] for row in rows(tmp_path / "t.csv")] == ["0-1", "0-2", "1"]
        assert [row["nx"] for row in rows(tmp_path / "t.csv")] == ["0", "0", "1"]
