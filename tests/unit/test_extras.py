"""What is not installed is named in one sentence, with the line that installs it."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.extras import PURPOSES, MissingExtraError, needed
from pretravel.design.fem.geometry import write_step
from pretravel.design.fem.mesh import mesh_probe
from pretravel.files.tables import read_parquet_table
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.surface.cad.part_file import read_part
from pretravel.touches import Touches
from tests.support.commands import run
from tests.support.examples import EXAMPLES

ROOT = Path(__file__).parents[2]
PACKAGES = {"netgen": "netgen-mesher", "skfem": "scikit-fem"}
"""Packages that are not called as their modules are."""


def _touches() -> Touches:
    return Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("module", "extra", "use"),
    [
        ("netgen", "cad", lambda _: read_part(EXAMPLES / "part.step")),
        ("shapely", "cad", lambda _: read_part(EXAMPLES / "part.step")),
        ("netgen", "fem", lambda _: mesh_probe(load_probe("omp40-2"))),
        ("skfem", "fem", lambda _: mesh_probe(load_probe("omp40-2"))),
        ("netgen", "fem", lambda folder: write_step(folder / "a.step", load_probe("omp40-2"))),
        ("pandas", "tables", lambda _: _touches().to_dataframe()),
        ("xarray", "tables", lambda _: predict(load_probe("omp40-2"), [[1, 0, 0]]).to_xarray()),
        ("pyarrow", "tables", lambda folder: read_parquet_table(folder / "t.parquet")),
    ],
)
def test_one_sentence_with_the_line_to_type(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    module: str,
    extra: str,
    use: Callable[[Path], object],
) -> None:
    monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path))  # a part that was read before is kept
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError) as caught:
        use(tmp_path)
    assert str(caught.value) == (
        f'this needs {module}, which {PURPOSES[module]}: pip install "pretravel[{extra}]"'
    )


def test_a_command_ends_with_the_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nicegui", None)
    assert 'pip install "pretravel[app]"' in run("app", "--no-browser", code=2)


def test_the_error_is_both_a_fault_of_the_user_and_an_import_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "netgen", None)
    for kind in (PretravelError, ImportError):
        with pytest.raises(kind):
            needed("netgen", "cad")


def test_every_module_comes_with_the_extras_of_which_it_is_said() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"]
    source = "".join(path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py"))
    for module in PURPOSES:
        package = PACKAGES.get(module, module)
        uses = [name for name in extras if f'needed("{module}", "{name}"' in source]
        assert uses, module
        for name in uses:
            assert any(need.startswith(f"{package}>") for need in extras[name]), (module, name)
        assert not any(need.startswith(f"{package}>") for need in project["dependencies"])
