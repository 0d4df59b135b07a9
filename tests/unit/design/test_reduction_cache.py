"""Kept models are found again, not confused with others, and not used when damaged."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.whole_files import one_process_at_a_time
from pretravel.design.fem import reduction_cache
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.interface_loads import INTERFACE
from pretravel.design.fem.mesh import MeshSettings
from pretravel.design.fem.reduction_cache import reduced_model, reduction_key
from pretravel.design.fem.seat_ball import ball_correction
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe, StepGeometry
from pretravel.prediction.materials import material
from tests.support.coarse_models import coarse_reduced_sixth

COARSE = MeshSettings(refinement=0.3)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(reduction_cache.FOLDER_VARIABLE, str(tmp_path))
    return tmp_path


@pytest.fixture
def forget() -> None:
    """Clear the memory of this process, so that the files are tested."""
    reduction_cache._remembered.cache_clear()


def whole_model() -> ReducedModel:
    """Of the images of the sixth, as one mesh."""
    field = coarse_reduced_sixth().elastic_field
    return replace(coarse_reduced_sixth(), load_field=lambda: field)


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> ReducedModel:
    """The model that is made, without its meshing anew: the cache looks at no number of it."""
    for step in ("ball_correction", "finite_element_model"):
        monkeypatch.setattr(reduction_cache, step, lambda *_: None)
    monkeypatch.setattr(reduction_cache, "mesh_probe", lambda *_: (None, None))
    monkeypatch.setattr(reduction_cache, "condense", lambda *_: coarse_reduced_sixth())
    return coarse_reduced_sixth()


def kept(folder: Path) -> Path:
    (path,) = folder.glob("reduced-*.npz")
    return path


@pytest.mark.parametrize("model", [whole_model, coarse_reduced_sixth])
def test_found_again_to_the_last_bit(
    omp40: Probe,
    folder: Path,
    forget: None,
    made: ReducedModel,
    monkeypatch: pytest.MonkeyPatch,
    model: Callable[[], ReducedModel],
) -> None:
    """A sixth is kept as one, and its images are made when they are asked for."""
    own = model()
    monkeypatch.setattr(reduction_cache, "condense", lambda *_: own)
    assert reduced_model(omp40, COARSE) is own
    reduction_cache._remembered.cache_clear()
    monkeypatch.setattr(reduction_cache, "condense", None)  # would fail if it were called
    again = reduced_model(omp40, COARSE)
    assert np.array_equal(again.flexibility, own.flexibility)
    assert np.array_equal(again.load_field().modes, own.load_field().modes)
    assert again.summary == own.summary
    field, found = own.elastic_field, again.elastic_field
    assert len(found.modes) > 4 * len(coarse_reduced_sixth().load_field().modes)
    assert np.array_equal(found.modes, field.modes)
    assert np.array_equal(found.mesh.elements, field.mesh.elements)
    assert found.mesh.faces.keys() == field.mesh.faces.keys()
    assert found.materials == field.materials
    assert np.all(again.lift(np.zeros(len(INTERFACE))) == 0.0)


def test_damaged_and_foreign_files_are_noticed_and_made_anew(
    omp40: Probe, folder: Path, forget: None, made: ReducedModel
) -> None:
    reduced_model(omp40, COARSE)
    path = kept(folder)
    whole = path.read_bytes()
    middle = bytearray(whole)
    at = whole.index(b"by_region.npy") + 2000
    middle[at : at + 8] = b"\x00\x01\x02\x03\x04\x05\x06\x07"
    foreign = whole.replace(b'"key": "', b'"key": "0', 1)
    for content in (whole[: len(whole) // 2], b"", b"nothing of ours", bytes(middle), foreign):
        path.write_bytes(content)
        reduction_cache._remembered.cache_clear()
        with pytest.warns(UserWarning, match="damaged or foreign"):
            again = reduced_model(omp40, COARSE)
        assert again is made
        assert path.stat().st_size == len(whole)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, str]:
    """A kept model and its key, made once."""
    probe, folder = load_probe("omp40-2"), tmp_path_factory.mktemp("cache")
    key = reduction_key(probe, COARSE)
    folder.chmod(0o700)
    reduction_cache._write(folder / "reduced-0.npz", coarse_reduced_sixth(), key)
    assert sys.platform == "win32" or kept(folder).stat().st_mode & 0o077 == 0
    return kept(folder).read_bytes(), key


@pytest.fixture
def path(whole: tuple[bytes, str], tmp_path: Path) -> Path:
    place = tmp_path / "reduced-0.npz"
    place.write_bytes(whole[0])
    place.chmod(0o600)
    return place


def _read(path: Path, whole: tuple[bytes, str]) -> ReducedModel | None:
    def make() -> ReducedModel:
        raise AssertionError("recomputed")

    return reduction_cache._read(path, whole[1], make)


def _rewritten(path: Path, change: Callable[[dict[str, np.ndarray]], None]) -> None:
    """By a program that knows the layout, and not the digests."""
    with np.load(path) as kept_arrays:
        arrays = dict(kept_arrays)
    change(arrays)
    with path.open("wb") as stream:
        np.savez(stream, **arrays)


def test_rewritten_without_a_change_it_is_used(path: Path, whole: tuple[bytes, str]) -> None:
    _rewritten(path, lambda arrays: None)
    found = _read(path, whole)
    assert found is not None
    assert np.all(np.isfinite(found.elastic_field.modes))


@pytest.mark.parametrize("factor", [2.0, np.nan])
@pytest.mark.parametrize("name", ["by_region", "resultants"])
def test_other_numbers_under_the_right_key_are_not_used(
    path: Path, whole: tuple[bytes, str], name: str, factor: float
) -> None:
    _rewritten(path, lambda arrays: arrays.update({name: factor * arrays[name]}))
    with pytest.warns(UserWarning, match=f"damaged or foreign .*{name}"):
        assert _read(path, whole) is None


def test_every_other_array_is_checked_when_it_is_read(path: Path, whole: tuple[bytes, str]) -> None:
    with np.load(path) as arrays:
        names = set(arrays) - {"by_region", "resultants", "header", "header_digest"}
    assert len(names) >= 10
    for name in names:
        path.write_bytes(whole[0])
        _rewritten(path, lambda arrays, name=name: arrays.update({name: 2 * arrays[name]}))
        found = _read(path, whole)
        assert found is not None
        with (
            pytest.warns(UserWarning, match="mesh of the cached model .* is damaged"),
            pytest.raises(AssertionError, match="recomputed"),
        ):
            _ = found.elastic_field


def test_a_changed_header_is_not_used(path: Path, whole: tuple[bytes, str]) -> None:
    """The compliance of the patch is in the header."""

    def change(arrays: dict[str, np.ndarray]) -> None:
        header = json.loads(bytes(arrays["header"]))
        header["patch_compliance"] *= 2.0
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)

    _rewritten(path, change)
    with pytest.warns(UserWarning, match="digest of its header"):
        assert _read(path, whole) is None


@pytest.mark.skipif(sys.platform == "win32", reason="no permissions of this kind")
class TestOtherUsers:
    """What others can write to is not read, and nothing is written there."""

    @pytest.mark.parametrize("mode", [0o620, 0o602])
    def test_a_file_that_others_can_write(
        self, path: Path, whole: tuple[bytes, str], mode: int
    ) -> None:
        path.chmod(mode)
        with pytest.warns(UserWarning, match="not used, because .* by other users"):
            assert _read(path, whole) is None

    def test_a_file_of_another_user(
        self, path: Path, whole: tuple[bytes, str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        owner = path.stat().st_uid
        if owner == 0:
            os.chown(path, 12345, -1)
        else:
            monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
        with pytest.warns(UserWarning, match="belongs to another user"):
            assert _read(path, whole) is None

    def test_a_folder_that_others_can_write(
        self, omp40: Probe, folder: Path, forget: None, made: ReducedModel
    ) -> None:
        folder.chmod(0o777)
        with pytest.warns(UserWarning, match="not used .* written to by other users"):
            reduced_model(omp40, COARSE)
        assert list(folder.iterdir()) == []

    @pytest.mark.parametrize("mode", [0o770, 0o777])
    def test_a_folder_above_that_others_can_write(
        self,
        omp40: Probe,
        tmp_path: Path,
        forget: None,
        made: ReducedModel,
        monkeypatch: pytest.MonkeyPatch,
        mode: int,
    ) -> None:
        """They could put another folder, with a model of theirs, into its place."""
        shared = tmp_path / "shared"
        monkeypatch.setenv(reduction_cache.FOLDER_VARIABLE, str(shared / "cache"))
        reduced_model(omp40, COARSE)
        shared.chmod(mode)
        kept(shared / "cache").write_bytes(b"forged")
        reduction_cache._remembered.cache_clear()
        with pytest.warns(UserWarning, match=r"not used \(.*/shared, which contains .* by other"):
            assert reduced_model(omp40, COARSE) is made
        assert kept(shared / "cache").read_bytes() == b"forged"
        reduction_cache._remembered.cache_clear()
        reduced_model(omp40, COARSE)  # it is said once: a warning would be an error here

    def test_a_link_of_others_in_place_of_the_lock(self, tmp_path: Path) -> None:
        letters, path = tmp_path / "letters.txt", tmp_path / "model.npz"
        letters.write_text("dear reader")
        (tmp_path / "model.npz.lock").symlink_to(letters)
        with one_process_at_a_time(path):
            pass
        assert letters.read_text() == "dear reader"


def test_damage_in_the_mesh_is_noticed_when_it_is_read(
    omp40: Probe, folder: Path, forget: None, made: ReducedModel
) -> None:
    reduced_model(omp40, COARSE)
    path = kept(folder)
    content = bytearray(path.read_bytes())
    at = bytes(content).index(b"modes.npy") + 5000
    content[at] ^= 0xFF
    path.write_bytes(content)
    reduction_cache._remembered.cache_clear()
    again = reduced_model(omp40, COARSE)  # the reduced part is whole
    with pytest.warns(UserWarning, match="mesh of the cached model .* is damaged"):
        field = again.elastic_field
    assert np.array_equal(field.modes, made.elastic_field.modes)
    assert path.read_bytes() != bytes(content)


def test_a_folder_that_cannot_be_written_is_said(
    omp40: Probe,
    tmp_path: Path,
    forget: None,
    made: ReducedModel,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv(reduction_cache.FOLDER_VARIABLE, str(blocked))
    with pytest.warns(UserWarning, match="is not used .* is not a folder"):
        reduced_model(omp40, COARSE)


def stepped(probe: Probe, folder: Path) -> list[Probe]:
    """STEP file: other content, another material and another choice of solids differ."""
    first, second = folder / "a.step", folder / "b.step"
    first.write_text("one")
    second.write_text("two")
    step = StepGeometry(first, ("T",), ("S",), ("B",))
    steel = material("steel")
    steps = [
        step,
        replace(step, path=second),
        replace(step, materials={"S": steel}),
        replace(step, stylus=("S", "U")),
    ]
    return [replace(probe, step=each) for each in steps]


@pytest.mark.long
def test_the_ball_is_in_the_kept_model(omp40: Probe, folder: Path, forget: None) -> None:
    made = reduced_model(omp40, COARSE)
    reduction_cache._remembered.cache_clear()
    for model in (made, reduced_model(omp40, COARSE)):
        assert model.ball_correction == pytest.approx(ball_correction(omp40), rel=1e-9)
        assert model.seat_part == "rods"


def test_the_key_knows_what_matters(omp40: Probe, tmp_path: Path) -> None:
    base = reduction_key(omp40, COARSE)
    assert omp40.hub is not None
    other = [
        replace(omp40, hub=replace(omp40.hub, height=10.0)),
        replace(omp40, hub_offset=15.0),
        replace(omp40, tripod=replace(omp40.tripod, rod_radius=2.0)),
        replace(omp40, seats=replace(omp40.seats, support_angle=0.5)),
        replace(omp40, seats=replace(omp40.seats, ball_radius=3.0)),
        replace(omp40, seats=replace(omp40.seats, contact="rigid")),
        replace(omp40, stylus=(omp40.stylus[0], replace(omp40.stylus[1], diameter=4.0))),
        replace(omp40, stylus=(omp40.stylus[0], replace(omp40.stylus[1], length=39.0))),
        replace(omp40, stylus=(replace(omp40.stylus[0], diameter=7.0), omp40.stylus[1])),
        *stepped(omp40, tmp_path),
        replace(omp40, tip=replace(omp40.tip, radius=2.5)),
        replace(
            omp40,
            tip=replace(omp40.tip, material=replace(omp40.tip.material, youngs_modulus=4e5 + 1.0)),
        ),
    ]
    keys = [reduction_key(probe, COARSE) for probe in other]
    keys.append(reduction_key(omp40, replace(COARSE, body=0.3)))
    assert len({base, *keys}) == len(keys) + 1
    same = [
        replace(omp40, preload=4.0, criterion="arm_lift", name="another"),
        replace(omp40, tip=replace(omp40.tip, u_radius=1e-3)),
    ]
    assert {reduction_key(probe, COARSE) for probe in same} == {base}


@pytest.mark.long
def test_from_the_cache_neither_kernel_nor_solver_is_loaded(
    omp40: Probe, folder: Path, forget: None, made: ReducedModel
) -> None:
    """The second run is fast, because it does not import CAD kernel, mesher and solver."""
    reduced_model(omp40)
    code = (
        "import sys, pretravel\n"
        "pretravel.predict(pretravel.load_probe('omp40-2'), [[1.0, 0.0, 0.0]], 'fem')\n"
        "print([m for m in ('netgen', 'skfem', 'pypardiso', 'matplotlib') if m in sys.modules])"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ
    )
    assert run.stdout.strip() == "[]"


def test_a_model_that_another_process_makes_is_waited_for(
    omp40: Probe, folder: Path, forget: None, made: ReducedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process holds the lock, writes the model and ends; this one reads it."""
    reduced_model(omp40, COARSE)
    path = kept(folder)
    reduction_cache._remembered.cache_clear()
    monkeypatch.setattr(reduction_cache, "condense", None)  # would fail if it were called
    path.rename(folder / "hidden")
    script = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from pretravel.base.whole_files import one_process_at_a_time\n"
        "path = Path(sys.argv[1])\n"
        "with one_process_at_a_time(path):\n"
        "    print('locked', flush=True)\n"
        "    time.sleep(1.0)\n"
        "    (path.parent / 'hidden').rename(path)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE) as one:
        assert one.stdout is not None
        assert one.stdout.readline() == b"locked\n"
        assert reduced_model(omp40, COARSE).summary
    assert one.returncode == 0


@pytest.mark.parametrize("name", ["by_region", "resultants", "patch_compliance", "ball_correction"])
def test_one_value_that_is_no_number_is_refused_though_digests_fit(
    path: Path, whole: tuple[bytes, str], name: str
) -> None:
    def change(arrays: dict[str, np.ndarray]) -> None:
        header = json.loads(bytes(arrays["header"]))
        if name in arrays:
            arrays[name] = arrays[name].copy()
            arrays[name].flat[0] = np.nan
            header["digests"][name] = reduction_cache._digest(arrays[name])
        else:
            header[name] = np.nan
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
        arrays["header_digest"] = np.array(reduction_cache._digest(arrays["header"]))

    _rewritten(path, change)
    with pytest.warns(UserWarning, match="damaged or foreign"):
        assert _read(path, whole) is None
