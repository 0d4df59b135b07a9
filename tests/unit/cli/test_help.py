"""Help texts have an example; a missing option is named."""

from __future__ import annotations

from tests.support.commands import run
from tests.support.examples import SPHERE


def test_help_everywhere() -> None:
    for command in ((), ("predict",), ("simulate",), ("qualify",), ("compensate",), ("probes",)):
        text = run(*command, "--help")
        assert "Example:" in text


def test_a_missing_option_is_named() -> None:
    assert "--diameter" in run("qualify", SPHERE, code=2)
