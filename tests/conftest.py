"""Settings of Hypothesis, and fixtures that the tests share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import pytest
import typer.main
import typer.testing
from hypothesis import HealthCheck, settings
from matplotlib.figure import Figure

from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.show.document import Picture
from tests.support import forked_processes

# Derandomised: a check that passes here passes on every machine.
settings.register_profile(
    "pretravel",
    derandomize=True,
    deadline=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
settings.load_profile("pretravel")


@cache
def _command(build: Callable[[typer.Typer], object], app: typer.Typer) -> object:
    return build(app)


@pytest.fixture(scope="session", autouse=True)
def _commands_are_built_once() -> None:
    """A program builds its commands once, in a tenth of a second; a worker runs hundreds."""
    build = typer.main.get_command
    for module, name in ((typer.main, "get_command"), (typer.testing, "_get_command")):
        setattr(module, name, lambda app: _command(build, app))


@pytest.fixture(scope="session", autouse=True)
def _readers_are_forked() -> None:
    forked_processes.use(forked_processes.forked_worker, forked_processes.forked_kernel)


@pytest.fixture
def real_processes() -> Iterator[None]:
    """The processes in which the program reads maps and parts, as it starts them."""
    forked_processes.use(*forked_processes.REAL)
    yield
    forked_processes.use(forked_processes.forked_worker, forked_processes.forked_kernel)


_draw = Picture.draw


def _without_layout(picture: Picture) -> Figure:
    figure = _draw(picture)
    figure.set_layout_engine("none")
    figure.set_dpi(50.0)
    for axes in figure.axes:
        axes.set_axis_off()
    return figure


@pytest.fixture(scope="session", autouse=True)
def _pictures_have_no_layout() -> None:
    """Most time of a picture goes into the places of its axes, into ticks with their numbers, and
    into its many pixels, which few tests look at."""
    Picture.draw = _without_layout  # type: ignore[method-assign]


@pytest.fixture
def laid_out_pictures() -> Iterator[None]:
    """Pictures with their axes placed, and of full size, as users see them."""
    Picture.draw = _draw  # type: ignore[method-assign]
    yield
    Picture.draw = _without_layout  # type: ignore[method-assign]


@pytest.fixture
def omp40() -> Probe:
    return load_probe("omp40-2")
