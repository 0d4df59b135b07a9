"""Bad input gets what a user needs: what, where (file and line), what to do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pretravel.directions import grid, sphere_pattern_25
from pretravel.errors import DescriptionError, InputError, PretravelError
from pretravel.formats.csv_table import read_csv_table
from pretravel.formats.map_file import read_map
from pretravel.formats.touches_csv import read_touches
from pretravel.probe.catalogue import catalogue_names, description_text, load_probe, parse_probe
from pretravel.qualification.qualification import qualify
from pretravel.touches import Touches
from tests.conftest import EXAMPLES, sphere_touches

HEADER = "x_mm,y_mm,z_mm,nx,ny,nz\n"
GOOD = "0,0,3,0,0,1\n"


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", None, "empty"),
        ("# only a comment\n\n", None, "empty"),
        (HEADER, 1, "no rows"),
        ("x_mm,y_mm,z_mm\n0,0,3\n", 1, "need the columns nx, ny, nz"),
        ("x_in,y_in,z_in,nx,ny,nz\n0,0,3,0,0,1\n", 1, "looks like inches"),
        (HEADER + GOOD + "0,0,nan,0,0,1\n", 3, "z_mm is 'nan'"),
        (HEADER + "# note\n" + GOOD + "\n0,0,,0,0,1\n", 5, "z_mm is empty"),
        (HEADER + "0,0,inf,0,0,1\n", 2, "not a finite number"),
        (HEADER + "0,0,3mm,0,0,1\n", 2, "z_mm is '3mm'"),
        (HEADER + GOOD + "0,0,3,0,0,0\n", 3, "is zero"),
        (HEADER + GOOD + "0,0,3,0,0,0.7\n", 3, "has length 0.7"),
        (HEADER + GOOD + "0,0,3,0,0\n", 3, "5 values, but the header names 6"),
        ("x_mm;y_mm;z_mm;nx;ny;nz\n0;0;3;0;0;1\n", 1, "semicolons"),
        ("x_mm\ty_mm\tz_mm\n0\t0\t3\n", 1, "tabs"),
        ("1,2,3,0,0,1\n" + GOOD, 1, "first line holds numbers"),
        ("x_mm,x_mm,z_mm,nx,ny,nz\n" + GOOD, 1, "there twice"),
        ("x_mm,y_mm,z_mm,nx,ny,nz,ax\n0,0,3,0,0,1,0\n", 1, "ay, az"),
        ("x_mm,y_mm,z_mm,nx,ny,nz,ax,ay,az\n0,0,3,0,0,1,0,0,1\n", None, "line 2"),
    ],
)
def test_touches_file(text: str, line: int | None, words: str, tmp_path: Path) -> None:
    path = tmp_path / "touches.csv"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_touches(path)
    assert words in str(error.value)
    assert str(path) in str(error.value)
    if line is not None:
        assert f"line {line}:" in str(error.value)


def test_other_things_than_text(tmp_path: Path) -> None:
    binary = tmp_path / "a.csv"
    binary.write_bytes(bytes(range(256)))
    for path, words in (
        (binary, "not a text file"),
        (tmp_path, "cannot be read"),
        (tmp_path / "none.csv", "no such file"),
    ):
        with pytest.raises(InputError, match=words):
            read_csv_table(path)


def test_windows_files_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(("\ufeff" + HEADER + GOOD + '"1",2,3,0,0,1\n').replace("\n", "\r\n").encode())
    assert read_touches(path).positions.tolist() == [[0, 0, 3], [1, 2, 3]]


def test_not_a_map(tmp_path: Path) -> None:
    text, other, half = tmp_path / "a.nc", tmp_path / "b.nc", tmp_path / "c.nc"
    text.write_text("hello")
    import h5py

    with h5py.File(other, "w") as file:
        file["x"] = 1.0
    import pretravel

    good = qualify(read_touches(EXAMPLES / "sphere_touches.csv"), 24.9987, kind="mean")
    pretravel.write_map(half, good.pretravel_map)
    half.write_bytes(half.read_bytes()[:2000])
    for path in (text, other, half):
        with pytest.raises(InputError, match="not a"):
            read_map(path)
    with pytest.raises(InputError, match="no such file"):
        read_map(tmp_path / "none.nc")
    table = tmp_path / "t.csv"
    table.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5\n")
    with pytest.raises(InputError, match="give --tip-diameter"):
        read_map(table)
    table.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5\n90,360,6\n")
    with pytest.raises(InputError, match="line 3: this direction is there twice"):
        read_map(table, tip_diameter=6.0)


def _example() -> Touches:
    return read_touches(EXAMPLES / "sphere_touches.csv")


def _in_inches(touches: Touches) -> Touches:
    return Touches(touches.positions / 25.4, touches.normals)


def _plane(touches: Touches) -> Touches:
    return touches.take(np.abs(touches.normals[:, 2]) < 0.01)


def _turned_normals(touches: Touches) -> Touches:
    return Touches(touches.positions, -touches.normals)


def _stray(touches: Touches) -> Touches:
    positions = touches.positions.copy()
    positions[20, 2] += 1000.0
    return Touches(positions, touches.normals, lines=touches.lines)


def _one_wrong_normal(touches: Touches) -> Touches:
    normals = touches.normals.copy()
    normals[7] = [0.0, 0.0, 1.0]
    return Touches(touches.positions, normals, lines=touches.lines)


@pytest.mark.parametrize("kind", ["mean", "harmonic"])
@pytest.mark.parametrize(
    ("change", "options", "words"),
    [
        (lambda t: t.take([0, 3]), {}, "2 touches in 2 directions are too few"),
        (lambda t: t.take([0, 1, 2]), {}, "in 1 direction are too few"),
        (_plane, {}, "in one plane (normal to Z)"),
        (_in_inches, {}, "look like inches"),
        (_in_inches, {"tip_diameter": None}, "may be inches"),
        (
            lambda t: t,
            {"diameter": 24.9987 / 25.4, "tip_diameter": 6 / 25.4},
            "diameters look like",
        ),
        (lambda t: t, {"diameter": 24.0}, "with this tip the sphere would measure 24.966"),
        (lambda t: t, {"diameter": 25.4}, "probes give by 1 to 80"),
        (_stray, {}, "touch 21 (line 22) lies 1000"),
        (_stray, {"tip_diameter": None}, "its position is wrong"),
        (lambda t: t, {"diameter": 12.49935}, "radius given as its diameter"),
        (lambda t: t, {"tip_diameter": 3.0}, "tip's radius given as its diameter"),
        (lambda t: t, {"diameter": 30.9987}, "pretravel"),
        (lambda t: t, {"diameter": 30.9987, "tip_diameter": None}, "Check --diameter"),
        (lambda t: t, {"diameter": -25.0}, "must be positive"),
        (lambda t: t, {"diameter": float("nan")}, "must be positive"),
        (lambda t: t, {"tip_diameter": 0.0}, "must be positive"),
        (_turned_normals, {}, "point the wrong way"),
        (_one_wrong_normal, {}, "touch 8 (line 9)"),
        (lambda t: t, {"axis": (0.0, 0.0, 2.0)}, "length 2"),
    ],
)
def test_qualification_refuses(
    kind: str, change: Callable[[Touches], Touches], options: dict[str, object], words: str
) -> None:
    arguments = {"diameter": 24.9987, "tip_diameter": 6.0, "kind": kind, **options}
    with pytest.raises(PretravelError) as error:
        qualify(change(_example()), **arguments)  # type: ignore[arg-type]
    assert words in str(error.value)


def test_surface_points_are_not_tip_centres() -> None:
    n = sphere_pattern_25()
    with pytest.raises(PretravelError, match="already compensated"):
        qualify(Touches(12.5 * n, n), 25.0, tip_diameter=6.0)


def test_sectors_without_a_touch() -> None:
    n = sphere_pattern_25()
    keep = ~((np.abs(n[:, 2]) < 0.5) & (n[:, 0] > 0.5))
    with pytest.raises(PretravelError, match=r"sector X?.*30°"):
        qualify(
            sphere_touches(np.full(25, 0.01)).take(keep), 25.0, tip_diameter=6.0, kind="sectors"
        )


def _edited(old: str, new: str) -> str:
    text = description_text("omp40-2")
    assert old in text
    return text.replace(old, new)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[0.0, 120.0, 240.0]", "[0.0, 10.0, 20.0]", "leave a gap"),
        ("[0.0, 120.0, 240.0]", "[0.0, 0.0, 180.0]", "gap"),
        ("[0.0, 120.0, 240.0]", "[0.0, 2.0, 180.5]", "leave a gap|apart"),
        ("[0.0, 120.0, 240.0]", "[0.0, 120.0]", "three numbers"),
        ("[0.0, 120.0, 240.0]", "[0.0, nan, 240.0]", "finite"),
        ("support_angle_deg = 27.266", "support_angle_deg = 0.0", "support angle is 0°"),
        ("support_angle_deg = 27.266", "support_angle_deg = 90.0", "support angle is 90°"),
        ("radius_mm = 16.34", "radius_mm = -16.34", "must be positive"),
        ("radius_mm = 16.34", "radius_mm = 1.0", "do not fit"),
        ("radius_mm = 16.34", "radius_mm = inf", "must be a finite number"),
        ("radius_mm = 3.0", "radius_mm = 2.0", "smaller than the stem"),
        ("length_mm = 38.0", "length_mm = -41.0", "must be positive"),
        ("length_mm = 38.0", 'length_mm = "long"', "must be a number"),
        ("length_mm = 38.0", "length_mm = true", "must be a number"),
        ('material = "ruby"', 'material = "glass"', "'glass' is not known"),
        ("preload_N = 5.91", "preload_N = 0.0", "preload is 0 N"),
        ("preload_N = 5.91", "preload_mN = 5910", "has no preload_mN"),
        ("offset_mm = 14.4", "offset_mm = -1.0", "between 0 and 1000"),
        ("offset_mm = 14.4", "offset_mm = nan", "nan"),
        ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 0.0, 2.0]", "unit vector"),
        ('criterion = "first_contact"', 'criterion = "luck"', "known are"),
        ("threshold_N = 0.0", "threshold_N = -1.0", "cannot be negative"),
        ("mass_g = 25.0", "mass_g = -25.0", "cannot be negative"),
        ("[spring]", "[springs]", r"\[spring\]"),
        ("u_radius_um = 0.2", "u_radius_mm = 0.2", "has no u_radius_mm"),
        ("[tripod]", "[tripod", "not valid TOML"),
    ],
)
def test_impossible_descriptions(old: str, new: str, words: str) -> None:
    with pytest.raises((InputError, DescriptionError), match=words) as error:
        parse_probe(_edited(old, new), "mine.toml")
    assert str(error.value).startswith("mine.toml")


def test_stylus_must_be_a_list() -> None:
    text = description_text("omp40-2")
    single = text[: text.index("[[stylus]]")] + text[text.index("[tip]") :]
    with pytest.raises(InputError, match=r"\[stylus\]"):
        parse_probe(single)
    with pytest.raises(InputError, match=r"write \[\[stylus\]\]"):
        parse_probe(single + "\n[stylus]\nlength_mm = 50.0\n")


def test_a_threshold_that_is_reached_at_rest(omp40) -> None:  # type: ignore[no-untyped-def]
    from dataclasses import replace

    from pretravel.trigger.predict import predict

    with pytest.raises(DescriptionError, match="never be seated"):
        predict(replace(omp40, threshold=2.2), [[1.0, 0.0, 0.0]])


@pytest.mark.parametrize("name", catalogue_names())
def test_every_number_of_the_catalogue_has_its_source(name: str) -> None:
    import tomllib

    tables = tomllib.loads(description_text(name))
    sources = tables.pop("sources")
    tables.pop("name")
    expected = set()
    for table, content in tables.items():
        entries = content if isinstance(content, list) else [content]
        for number, entry in enumerate(entries, start=1):
            prefix = f"{table}.{number}" if isinstance(content, list) else table
            expected |= {f"{prefix}.{key}" for key in entry}
    assert set(sources) == expected
    assert all(sources.values())
    load_probe(name)


class TestMapFiles:
    def _written(self, tmp_path: Path, **options: object) -> Path:
        import pretravel

        made = qualify(_example(), 24.9987, tip_diameter=6.0, kind="mean", **options)  # type: ignore[arg-type]
        path = tmp_path / "map.nc"
        pretravel.write_map(path, made.pretravel_map)
        return path

    def test_damage_is_noticed(self, tmp_path: Path) -> None:
        """The coefficient's eight bytes, found by value, changed in the last place but two."""
        path = self._written(tmp_path)
        value = read_map(path).coefficients[0]
        raw = path.read_bytes()
        assert raw.count(value.tobytes()) == 1
        path.write_bytes(raw.replace(value.tobytes(), (value * 1.001).tobytes()))
        with pytest.raises(InputError, match="damaged"):
            read_map(path)

    def test_a_qualified_map_is_good_with_its_own_tip_only(self, tmp_path: Path) -> None:
        path = self._written(tmp_path)
        assert read_map(path, tip_diameter=6.0).tip_radius == 3.0
        with pytest.raises(PretravelError, match="qualified with a tip of 6 mm"):
            read_map(path, tip_diameter=3.0)

    @pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, 0.0, -0.8)])
    def test_a_table_keeps_axis_noise_and_tip(
        self, tmp_path: Path, axis: tuple[float, float, float]
    ) -> None:
        import pretravel
        from pretravel.frames import probe_rotation

        rotation = probe_rotation(axis, 0.4)
        nodes = grid(np.radians(np.arange(5, 90, 5)), np.radians(np.arange(0, 360, 10)))
        from pretravel.maps.bases import TabulatedBasis
        from pretravel.maps.pretravel_map import PretravelMap
        from pretravel.maps.support import DirectionSupport

        support = DirectionSupport(nodes)
        made = PretravelMap(
            TabulatedBasis(support), 0.01 + 0.002 * nodes[:, 0], np.full(len(nodes), 4e-8), support,
            tip_radius=3.0, u_tip_radius=2e-4, repeatability=3e-4, rotation=rotation,
        )  # fmt: skip
        pretravel.write_map(tmp_path / "map.csv", made)
        back = read_map(tmp_path / "map.csv")
        normals = nodes @ rotation.T
        # The table's grid of 5° by 10° holds the nodes: equal to its twelve digits.
        assert np.allclose(back.pretravel(normals), made.pretravel(normals), atol=1e-9)
        assert np.allclose(back.standard_uncertainty(normals), 2e-4, rtol=1e-6)
        assert back.repeatability == pytest.approx(3e-4)
        assert back.u_tip_radius == pytest.approx(2e-4)
        assert np.allclose(back.rotation, rotation, atol=1e-9)

    def test_a_table_with_two_tips(self, tmp_path: Path) -> None:
        path = tmp_path / "t.csv"
        path.write_text("polar_deg,azimuth_deg,pretravel_um,tip_radius_mm\n90,0,5,3\n90,9,5,2\n")
        with pytest.raises(InputError, match=r"line 3: tip_radius_mm is 2, but 3"):
            read_map(path)

    def test_a_table_in_the_wrong_unit(self, tmp_path: Path) -> None:
        path = tmp_path / "t.csv"
        path.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5000\n")
        with pytest.raises(InputError, match="line 2: pretravel_um is 5000"):
            read_map(path, tip_diameter=6.0)
