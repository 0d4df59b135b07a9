"""Every number of the command line has a range, and is finite."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import typer

from pretravel.cli import main
from tests.support.commands import run


def _numbers() -> Iterator[tuple[str, str, Any]]:
    """Command, name and parameter of each number."""
    group: Any = typer.main.get_command(main.app)
    for name, command in group.commands.items():
        for inner in getattr(command, "commands", {name: command}).values():
            for parameter in inner.params:
                if parameter.type_descriptor.annotation in (float, int):
                    yield inner.name, parameter.name, parameter


def test_every_number_has_a_range() -> None:
    found = list(_numbers())
    assert len(found) > 50
    without = [(c, n) for c, n, option in found if option.min is None or option.max is None]
    assert without == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("pattern iso10360-5 --diameter 25 --turn nan -o t.csv", "--turn nan"),
        ("pattern iso10360-5 --diameter 25 --turn inf -o t.csv", "--turn inf"),
        ("pattern iso10360-5 --diameter 25 --clearance nan -o t.csv", "--clearance nan"),
        ("pattern iso10360-5 --diameter 25 --center nan,0,0 -o t.csv", "--center nan,0,0"),
        ("pattern iso10360-5 --diameter 25 --center 1e308,0,0 -o t.csv", "--center 1e308,0,0"),
        ("pattern iso10360-5 --diameter 25 --repeats 1e400 -o t.csv", "--repeats 1e400"),
        ("check iso10360-5 t.csv --diameter inf", "--diameter inf"),
        ("check iso10360-5 t.csv --diameter 25 --tip-diameter -1", "--tip-diameter"),
        ("convert t.csv --tip-diameter nan -o t.msr", "--tip-diameter nan"),
        ("convert t.csv --tip-diameter nan -o t.qif", "--tip-diameter nan"),
        ("convert t.csv --offset nan,0,0 -o u.csv", "--offset nan,0,0"),
        ("convert t.csv --feed 1e308 -o u.csv", "--feed 1e308"),
        ("separation-plan --u-systematic inf", "--u-systematic inf"),
        ("separate r.csv --repeat-variance 1e308 --repeat-pair 1,1", "--repeat-variance 1e308"),
        ("hysteresis omp40-2 --friction inf", "--friction inf"),
        ("hysteresis omp40-2 --cycles 100000000", "--cycles"),
        ("simulate omp40-2 --surface convex --targets t.csv --noise 1e308 -o u.csv", "--noise"),
        ("simulate omp40-2 --surface convex --targets t.csv --friction inf -o u.csv", "--friction"),
        ("simulate omp40-2 --surface convex --targets t.csv --seed -1 -o u.csv", "--seed"),
        ("export map.json --to linuxcnc --tolerance inf -o f", "--tolerance inf"),
        ("measure p.csv --feature bore --form-tolerance inf", "--form-tolerance inf"),
        ("qualify t.csv --diameter 25 --lobe-azimuth nan", "--lobe-azimuth nan"),
        ("predict omp40-2 --azimuth 1e308", "--azimuth 1e308"),
        ("predict omp40-2 --azimuth 0:1e308:1", "--azimuth"),
        ("predict omp40-2 --lever -5", "--lever -5"),
        ("plan ellipsoid:a=1e308,b=1,c=1 --grid 3x3 -o p.csv", "a= is 1e+308"),
        ("compensate t.csv --map m.json --place 0,0,0,1e308,0,0 -o p.csv", "1e+308"),
        ("separate r.csv --repeat-variance 1 --repeat-pair 1e300,1", "1e300,1: one of the numbers"),
        ("plan convex --grid ²x3 -o p.csv", "--grid"),
        ("qualify t.csv --diameter 2_5", "--diameter 2_5: it must be a number"),
        ("hysteresis omp40-2 --cycles=1_0", "--cycles 1_0: it must be a number"),
        ("compensate t.csv --map m.json --place 1_0,0,0 -o p.csv", "placement '1_0,0,0'"),
        ("compensate t.csv --map m.json --place 1,2,3,0,0,9 -o p.csv", "of the part, or of the m"),
        ("program sphere m.toml --diameter 25 --feeds nan -o s.ngc", "--feeds nan"),
    ],
)
def test_numbers_that_nothing_has_are_refused(arguments: str, words: str) -> None:
    """The value is named with its option, before any file is read."""
    assert words in run(*arguments.split(), code=2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("qualify t.csv --diameter 24,9987",
         "--diameter 24,9987: the decimal sign is a point: write 24.9987"),
        ("qualify t.csv --diameter -0,5", "write -0.5"),
        ("qualify t.csv --diameter 1.024,5", "write 1024.5"),
        ("qualify t.csv --diameter 12,345", "write 12.345 (or 12345, if the comma separates"),
        ("separate r.csv --repeat-variance 1,5e-1 --repeat-pair 1,1", "write 1.5e-1"),
        ("slide omp40-2 --surface convex --at 0,5,0,5", "the decimal sign is a point, as in 2.5"),
        ("slide omp40-2 --surface sphere:radius=12,5 --at 0.5,0.5", "the decimal sign is a point"),
        ("predict omp40-2 --polar 0:90:2,5", "the decimal sign is a point, as in 2.5"),
        ("qualify t.csv --diameter 25 --axial-pretravel 1,5", "the decimal sign is a point"),
        ("compensate t.csv --map m.json --place 1,5,2,0,0,0,0 -o p.csv", "sign is a point"),
    ],
)  # fmt: skip
def test_a_decimal_comma_is_answered_with_the_number_to_write(arguments: str, words: str) -> None:
    assert words in run(*arguments.split(), code=2)


def test_other_texts_are_no_numbers_with_a_comma() -> None:
    assert "unable to parse" in run("qualify", "t.csv", "--diameter", "a,b", code=2)
    assert "the decimal sign" not in run("pattern", "iso10360-5", "--diameter", "25", "--repeats",
                                         "1,5", "-o", "t.csv", code=2)  # fmt: skip
