"""Positions without labels are joined with the plan that was run."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import FilePositions
from pretravel.files.logs.joining import join
from pretravel.probing.targets import Targets
from tests.support.control_logs import (
    PLAN,
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
            ([[0.0, 0, 2.99], [0, 0.2, 2.99]], "line of no target; the nearest is a, 0.200 mm"),
            ([[0.0, 0, 2.99], [0, 0, 2.98]], "more readings than the plan"),
            ([[0.0, 0, 2.99 * 25.4]], "line of no target"),
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
        assert found.notes()[1].endswith("line of no target, or of several: line 5")
        stray = FilePositions("log", seen, (4, 5, 6, 7), (True, True, False, True))
        with pytest.raises(InputError, match=r"line 5: .*line of no target"):
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
