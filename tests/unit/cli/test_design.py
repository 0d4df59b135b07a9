"""The commands design and wishes, as docs/design.md shows them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pretravel.base.toml_file import parse_toml
from pretravel.design.studies.wish import WISHES, wish_in
from pretravel.prediction.catalogue import load_probe
from tests.support.commands import run
from tests.support.pictures import coloured_share

GUIDE = (Path(__file__).parents[3] / "docs/design.md").read_text(encoding="utf-8")
SHORT = """
[wish]
name = "short"
least = "pretravel_greatest"
[directions]
azimuth_deg = "0:330:30"
polar_deg = 90.0
[[free]]
key = "spring.preload_N"
range = [4.0, 8.0]
"""


def test_the_wish_of_the_guide_is_one() -> None:
    (text,) = re.findall(r"^```toml\n(.*?)^```$", GUIDE, re.S | re.M)
    made = wish_in(parse_toml(text))
    assert (made.goal, made.overtravel, len(made.limits)) == ("pretravel_deviation", 5.0, 2)


@pytest.mark.long
def test_the_best_probe_is_written_and_can_be_predicted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The least preload of the range bends least."""
    monkeypatch.chdir(tmp_path)
    Path("wish.toml").write_text(SHORT)
    said = run("design", "wish.toml", "-o", "best.toml", "--plot", "best.png")
    assert re.search(r"spring.preload_N\s+4\s+lower end of the range", said)
    assert load_probe("best.toml").preload == pytest.approx(4.0, abs=1e-3)
    assert coloured_share("best.png") > 0.001
    run("predict", "best.toml", "--polar", "90", "-o", "map.csv")


def test_wishes_are_listed_and_printed() -> None:
    listed = run("wishes")
    for name in WISHES.names():
        assert name in listed
        assert "[wish]" in run("wishes", name)
