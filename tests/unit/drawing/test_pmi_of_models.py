"""PMI of a model: its text is ours, appended to the bracket; what it states is what is read."""

from pathlib import Path
from typing import Any

import pytest

from pretravel.base.errors import InputError
from pretravel.drawing.pmi.model import read_drawing
from pretravel.drawing.pmi.part21 import read_part21
from pretravel.drawing.tasks.drawing.task import FoundDrawing, ReadDrawing
from tests.support.examples import EXAMPLES
from tests.support.pmi_text import (
    ALL_DATUMS,
    UNITS,
    bound,
    length,
    numbers,
    plus_minus,
    size,
)
from tests.unit.drawing.conftest import Reader


def test_datums_with_their_faces(bracket: Reader) -> None:
    found = bracket(ALL_DATUMS)
    assert [
        (datum.letter, numbers(found, datum.place.faces)) for datum in found.pmi.datums
    ] == [("A", [5]), ("B", [1]), ("D", [12])]  # fmt: skip


def test_inches_in_a_model_in_mm(bracket: Reader) -> None:
    """0.5 in + 0.001/-0.002 in is 12.7 mm + 0.0254/-0.0508 mm; an inch is 25.4 mm."""
    found = bracket(UNITS, size(2200, 12, 0.5, 2001), plus_minus(2210, 2201, -0.002, 0.001, 2001))
    (one,) = found.pmi.sizes
    assert (one.nominal, one.lower, one.upper) == (12.7, 12.6492, 12.7254)
    (feature,) = found.drawn.features
    assert feature.remarks == ["the model has a diameter of 12 mm"]


def test_limits_stated_as_values(bracket: Reader) -> None:
    text = size(2200, 12, 12.0).replace("(#2203),", "(#2203,#2220,#2221),")
    added = length(2220, 12.02, name="upper limit") + length(2221, 11.98, name="lower limit")
    (one,) = bracket(text, added).pmi.sizes
    assert (one.nominal, one.lower, one.upper) == (12.0, 11.98, 12.02)


@pytest.mark.parametrize(
    ("face", "nominal", "form", "grade", "limits"),
    [  # ISO 286-1: 10 to 18 mm IT6 11 µm, IT7 18 µm, g −6 µm
        (12, 12.0, "H", "7", (12.0, 12.018)),
        (13, 14.0, "g", "6", (13.983, 13.994)),
        (13, 14.0, "g", "IT6", (13.983, 13.994)),
        (13, 14.0, "n", "6", (14.012, 14.023)),  # n +12 µm
        (12, 12.0, "N", "7", (11.977, 11.995)),  # −12 + 7: the step from IT6 to IT7
        (13, 14.0, "zc", "6", (None, None)),
    ],
)
def test_fits(
    bracket: Reader, face: int, nominal: float, form: str, grade: str, limits: Any
) -> None:
    fit = (
        f"#2210=LIMITS_AND_FITS('{form}','','{grade}','ISO 286');"
        "#2211=PLUS_MINUS_TOLERANCE(#2210,#2201);"
    )
    found = bracket(size(2200, face, nominal), fit)
    (one,) = found.pmi.sizes
    assert one.fit == form + grade.removeprefix("IT")
    assert (one.lower, one.upper) == limits
    assert (one.number in found.drawn.left_out) == (limits[0] is None)


def test_a_complex_tolerance_with_modifiers_in_its_frame(bracket: Reader) -> None:
    text = (
        "#2300=SHAPE_ASPECT('','',#4,.T.);"
        + bound(2301, 2300, 14)
        + length(2302, 0.05)
        + "#2303=(GEOMETRIC_TOLERANCE('','',#2302,#2300)"
        "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2136))"
        "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.MAXIMUM_MATERIAL_REQUIREMENT.))POSITION_TOLERANCE());"
        "#2304=TOLERANCE_ZONE('',$,#4,.F.,(#2303),#2305);"
        "#2305=TOLERANCE_ZONE_FORM('cylindrical or circular');"
    )
    found = bracket(
        ALL_DATUMS, text, size(2200, 14, 8.0), plus_minus(2210, 2201, -0.01, 0.03),
        size(2220, 12, 12.0), plus_minus(2230, 2221, 0.0, 0.02),
    )  # fmt: skip
    (one,) = found.pmi.tolerances
    assert (one.kind, one.zone, one.form) == ("position", 0.05, "cylindrical or circular")
    assert [each.text for each in one.datums] == ["A", "D(M)", "B"]
    assert one.signs == ("M",)
    assert numbers(found, one.place.faces) == [14]
    (geometric,) = found.drawn.drawing.feature[-1].geometric
    assert (geometric.datums, geometric.material) == (("A", "D(M)", "B"), "M")
    assert found.drawn.left_out == {}


def test_a_common_datum(bracket: Reader) -> None:
    text = (
        "#2300=SHAPE_ASPECT('','',#4,.T.);"
        + bound(2301, 2300, 13)
        + length(2302, 0.02)
        + "#2303=CIRCULAR_RUNOUT_TOLERANCE('','',#2302,#2300,(#2140));"
    )
    found = bracket(ALL_DATUMS, text)
    assert [each.text for each in found.pmi.tolerances[0].datums] == ["D-B"]
    assert found.drawn.drawing.feature[-1].geometric[0].datums == ("D-B",)


@pytest.mark.parametrize("nominal", [-8.0, 0.0])
def test_a_size_that_none_is_has_a_line_with_the_reason(bracket: Reader, nominal: float) -> None:
    found = bracket(size(2200, 14, nominal) + plus_minus(2210, 2201, -0.01, 0.03))
    (one,) = found.drawn.not_decided
    assert one.reason == f"its nominal value is {nominal:g} mm, which no size is"


@pytest.mark.parametrize(
    ("entities", "sign"),
    [
        ("GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE(#2310)SURFACE_PROFILE_TOLERANCE()",
         "at most 0.02 mm"),
        ("SURFACE_PROFILE_TOLERANCE()TOLERANCE_OF_TOMORROW(3)",
         "TOLERANCE_OF_TOMORROW (not understood)"),
        ("GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.TANGENT_PLANE.))SURFACE_PROFILE_TOLERANCE()", "T"),
    ],
)  # fmt: skip
def test_what_is_not_decided_is_left_out_by_name(bracket: Reader, entities: str, sign: str) -> None:
    """It is a comment, and an entry: the answer has a line for it."""
    text = (
        "#2300=SHAPE_ASPECT('','',#4,.T.);"
        + bound(2301, 2300, 3)
        + length(2302, 0.1)
        + length(2310, 0.02)
        + f"#2303=(GEOMETRIC_TOLERANCE('','',#2302,#2300){entities});"
    )
    found = bracket(text)
    assert found.pmi.tolerances[0].signs == (sign,)
    assert found.drawn.left_out == {2303: f"'{sign}' is not decided here"}
    assert f"#   profile 0.1 mm ({sign}), faces 3 (#2303): '{sign}'" in found.text
    (one,) = found.drawn.not_decided
    assert (one.feature, one.characteristic) == ("face 3 (#2303)", f"profile ({sign})")
    assert one.ends == (0.0, 0.1)


def test_a_projected_zone(bracket: Reader) -> None:
    text = (
        "#2300=SHAPE_ASPECT('','',#4,.T.);"
        + bound(2301, 2300, 14)
        + length(2302, 0.05)
        + length(2306, 25.0)
        + "#2303=(GEOMETRIC_TOLERANCE('','',#2302,#2300)"
        "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2135))POSITION_TOLERANCE());"
        "#2304=TOLERANCE_ZONE('',$,#4,.F.,(#2303),#2305);"
        "#2305=TOLERANCE_ZONE_FORM('cylindrical or circular');"
        "#2307=PROJECTED_ZONE_DEFINITION(#2304,(),#2300,#2306);"
    )
    found = bracket(ALL_DATUMS, text)
    assert found.pmi.tolerances[0].signs == ("P 25",)
    assert not {each.number for each in found.pmi.unread} & {2304, 2305, 2307}


def test_all_around_and_parts_of_an_aspect(bracket: Reader) -> None:
    """Faces of an aspect are those of its parts; all around 1, 2 and 6."""
    text = (
        "#2300=ALL_AROUND_SHAPE_ASPECT('','',#4,.F.);"
        + "".join(
            f"#{2310 + k}=SHAPE_ASPECT('','',#4,.T.);"
            f"#{2320 + k}=SHAPE_ASPECT_RELATIONSHIP('',$,#2300,#{2310 + k});"
            + bound(2330 + k, 2310 + k, face)
            for k, face in enumerate((1, 2, 6))
        )
        + length(2302, 0.1)
        + "#2303=(GEOMETRIC_TOLERANCE('','',#2302,#2300)"
        "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2135))SURFACE_PROFILE_TOLERANCE());"
    )
    found = bracket(ALL_DATUMS, text)
    (one,) = found.pmi.tolerances
    assert one.place.around
    assert numbers(found, one.place.faces) == [1, 2, 6]
    (feature,) = (each for each in found.drawn.drawing.feature if each.geometric)
    assert (feature.kind, feature.faces) == ("surface", (1, 2, 6))


def test_a_profile_between_two_edges_is_of_the_faces_between(bracket: Reader) -> None:
    """The text names the faces; an orientation between two places has no zone of its own."""
    text = (
        "#2300=BETWEEN_SHAPE_ASPECT('','',#4,.T.);"
        + bound(2301, 2300, 1)
        + bound(2305, 2300, 2)
        + length(2302, 0.1)
        + "#2303=SURFACE_PROFILE_TOLERANCE('','',#2302,#2300);"
    )
    found = bracket(text)
    (feature,) = (each for each in found.drawn.drawing.feature if each.geometric)
    assert (feature.kind, feature.faces) == ("surface", (1, 2))
    assert found.drawn.left_out == {}
    other = bracket(text.replace("SURFACE_PROFILE_TOLERANCE", "FLATNESS_TOLERANCE"))
    assert "'between'" in other.drawn.left_out[2303]


def test_a_tangent_plane(bracket: Reader) -> None:
    text = (
        "#2300=SHAPE_ASPECT('','',#4,.T.);"
        + bound(2301, 2300, 1)
        + length(2302, 0.02)
        + "#2303=(GEOMETRIC_TOLERANCE('','',#2302,#2300)"
        "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2135))"
        "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.TANGENT_PLANE.))PERPENDICULARITY_TOLERANCE());"
    )
    found = bracket(ALL_DATUMS, text)
    (one,) = (one for each in found.drawn.drawing.feature for one in each.geometric)
    assert one.tangent
    assert one.name == "perpendicularity (T) to A"
    assert "  tangent = true\n" in found.text


def test_a_slot_and_a_width(bracket: Reader) -> None:
    """Faces 9 and 11 are 40 mm apart and face away from each other or towards: one slot."""
    text = size(2200, 9, 40.0).replace("'diameter'", "'thickness'") + bound(2240, 2200, 11)
    found = bracket(text, plus_minus(2210, 2201, -0.1, 0.1))
    (feature,) = found.drawn.drawing.feature
    assert (feature.kind, feature.tolerance, feature.nominal) == ("slot", "39.9..40.1", 40.0)
    assert feature.at is not None
    assert feature.at[0] == pytest.approx(40.0)  # planes x = 20 and x = 60


def _target(number: int, name: str, form: str, at: tuple[float, ...], size: float) -> str:
    """A target of datum C (#2400) on face 3."""
    n = number
    return (
        f"#{n}=PLACED_DATUM_TARGET_FEATURE('','{form}',#4,.T.,'{name}');"
        f"#{n + 1}=SHAPE_ASPECT_RELATIONSHIP('','',#{n},#2400);"
        f"#{n + 2}=PROPERTY_DEFINITION('','',#{n});"
        + (length(n + 3, size, name="target diameter") if size else "")
        + f"#{n + 4}=AXIS2_PLACEMENT_3D('',#{n + 5},$,$); #{n + 5}=CARTESIAN_POINT('',{at});"
        f"#{n + 6}=SHAPE_REPRESENTATION_WITH_PARAMETERS('',({f'#{n + 3},' * (size > 0)}#{n + 4}),"
        f"#1059); #{n + 7}=SHAPE_DEFINITION_REPRESENTATION(#{n + 2},#{n + 6});"
        + bound(n + 8, number, 3)
    )


class TestDatumTargets:
    def test_of_a_plane(self, bracket: Reader) -> None:
        text = "#2400=DATUM('',$,#4,.F.,'C');" + "".join(
            _target(2410 + 10 * k, f"{k + 1}", form, at, size)
            for k, (form, at, size) in enumerate(
                [
                    ("circle", (5.0, 5.0, 20.0), 5.0),
                    ("point", (75.0, 5.0, 20.0), 0.0),
                    ("point", (40.0, 45.0, 20.0), 0.0),
                ]
            )
        )
        found = bracket(text)
        assert found.drawn.left_out == {}
        (datum,) = found.drawn.drawing.feature
        assert (datum.label, datum.association) == ("C", "tangent")
        assert datum.targets == ((5.0, 5.0, 20.0, 5.0), (75.0, 5.0, 20.0, 0.0),
                                 (40.0, 45.0, 20.0, 0.0))  # fmt: skip
        assert "targets_mm = [[5.0, 5.0, 20.0, 5.0], [75.0" in found.text

    def test_an_area_that_is_bound_to_nothing_is_on_the_plane_where_it_lies(
        self, bracket: Reader
    ) -> None:
        """As in CTC 5 of NIST: the text gives its place and its size alone."""
        target = _target(2410, "1", "circle", (10.0, 10.0, 20.0), 5.0)
        found = bracket("#2400=DATUM('',$,#4,.F.,'C');" + target.partition("#2418=")[0])
        (datum,) = found.drawn.drawing.feature
        assert (datum.faces, datum.targets) == ((3,), ((10.0, 10.0, 20.0, 5.0),))
        away = _target(2410, "1", "circle", (10.0, 10.0, 21.0), 5.0)
        found = bracket("#2400=DATUM('',$,#4,.F.,'C');" + away.partition("#2418=")[0])
        assert found.drawn.left_out == {2400: "the file does not assign it to a face"}

    def test_one_point_is_a_datum_of_touched_places(self, bracket: Reader) -> None:
        found = bracket(
            "#2400=DATUM('',$,#4,.F.,'C');" + _target(2410, "1", "point", (1.0, 2.0, 20.0), 5.0)
        )
        (target,) = found.pmi.datums[0].targets
        assert (target.form, target.sizes[0].value, target.at) == ("point", 5.0, (1.0, 2.0, 20.0))
        (datum,) = found.drawn.drawing.feature
        assert (datum.kind, datum.faces, datum.association) == ("surface", (3,), "tangent")
        assert datum.targets == ((1.0, 2.0, 20.0, 0.0),)
        assert found.pmi.unread == ()

    @pytest.mark.parametrize(
        ("axes", "ends"),
        [
            ("#2419,#2420", (20.0, 10.0, 20.0, 50.0, 10.0, 20.0)),  # from it, along its x axis
            ("#2420,#2419", (20.0, 10.0, 20.0, 50.0, 10.0, 20.0)),  # along its z axis
            ("#2419,#2421", (35.0, 10.0, 20.0, 5.0, 10.0, 20.0)),  # it is in the middle
        ],
    )
    def test_a_line_lies_on_its_face(
        self, bracket: Reader, axes: str, ends: tuple[float, ...]
    ) -> None:
        text = _target(2410, "1", "line", (20.0, 10.0, 20.0), 30.0).replace(
            "#2415,$,$", f"#2415,{axes}"
        )
        directions = (
            "#2419=DIRECTION('',(0.,0.,1.));#2420=DIRECTION('',(1.,0.,0.));"
            "#2421=DIRECTION('',(-1.,0.,0.));"
        )
        found = bracket("#2400=DATUM('',$,#4,.F.,'C');" + text + directions)
        (datum,) = found.drawn.drawing.feature
        assert (datum.kind, datum.target_lines) == ("surface", (ends,))
        assert "target_lines_mm = [[" in found.text

    def test_other_forms_have_a_line_with_the_reason(self, bracket: Reader) -> None:
        found = bracket(
            "#2400=DATUM('',$,#4,.F.,'C');"
            + _target(2410, "1", "circular curve", (10.0, 10.0, 20.0), 5.0)
        )
        assert "its target C1 is a circular curve; points, lines" in found.drawn.left_out[2400]
        assert "target C1 circular curve" in found.text

    @pytest.mark.parametrize(
        "more",
        [
            "DIRECTION('movable direction',(1.,0.,0.))",
            "AXIS2_PLACEMENT_3D('movable direction',#2415,$,$)",
        ],
    )
    def test_a_movable_one_has_a_line_with_the_reason(self, bracket: Reader, more: str) -> None:
        text = _target(2410, "1", "point", (1.0, 2.0, 20.0), 0.0)
        assert "(#2414),#1059" in text
        text = text.replace("(#2414),#1059", "(#2414,#2490),#1059") + f"#2490={more};"
        found = bracket("#2400=DATUM('',$,#4,.F.,'C');" + text)
        assert found.pmi.datums[0].targets[0].at == (1.0, 2.0, 20.0)
        assert found.drawn.left_out[2400].startswith("its target C1 is movable. To decide")

    def test_faces_and_edges_of_the_model_are_targets(self, bracket: Reader) -> None:
        """Targets without a placement, as the text binds them to geometry."""
        area = (
            "#2400=DATUM('',$,#4,.F.,'C'); #2410=DATUM_TARGET('','area',#4,.T.,'1');"
            "#2411=SHAPE_ASPECT_RELATIONSHIP('','',#2410,#2400);" + bound(2412, 2410, 3)
        )
        (datum,) = bracket(area).drawn.drawing.feature
        assert (datum.kind, datum.faces, datum.targets) == ("plane", (3,), ())
        line = (
            "#2400=DATUM('',$,#4,.F.,'C'); #2401=DATUM_FEATURE('',$,#4,.T.);"
            "#2402=SHAPE_ASPECT_RELATIONSHIP('',$,#2401,#2400);"
            + bound(2403, 2401, 3)
            + "#2410=DATUM_TARGET('','line',#4,.T.,'1');"
            "#2411=SHAPE_ASPECT_RELATIONSHIP('','',#2410,#2400);"
            "#2412=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2410,#10,#112);"
            "#2420=DATUM_TARGET('','point',#4,.T.,'2');"
            "#2421=SHAPE_ASPECT_RELATIONSHIP('','',#2420,#2400);"
            "#2422=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2420,#10,#2423);"
            "#2423=CARTESIAN_POINT('',(70.,25.,20.));"
        )
        (datum,) = bracket(line).drawn.drawing.feature
        assert (datum.kind, datum.faces) == ("plane", (3,))
        assert datum.target_lines == ((0.0, 0.0, 20.0, 0.0, 50.0, 20.0),)  # edge #112
        assert datum.targets == ((70.0, 25.0, 20.0, 0.0),)

    def test_a_target_without_its_datum_is_of_the_letter(self, bracket: Reader) -> None:
        text = _target(2410, "C1", "point", (1.0, 2.0, 20.0), 0.0)
        relation = "#2411=SHAPE_ASPECT_RELATIONSHIP('','',#2410,#2400);"
        assert relation in text
        found = bracket("#2400=DATUM('',$,#4,.F.,'C');" + text.replace(relation, ""))
        (datum,) = found.drawn.drawing.feature
        assert datum.targets == ((1.0, 2.0, 20.0, 0.0),)
        assert found.pmi.unread == ()


DEGREES = """\
#2600=(CONVERSION_BASED_UNIT('DEGREE',#2601)NAMED_UNIT(#2602)PLANE_ANGLE_UNIT());
#2601=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925199433),#2004);
#2602=DIMENSIONAL_EXPONENTS(0.,0.,0.,0.,0.,0.,0.);
"""


def _degrees(number: int, value: float, name: str) -> str:
    return (
        f"#{number}=(MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE({value}),"
        f"#2600)PLANE_ANGLE_MEASURE_WITH_UNIT()REPRESENTATION_ITEM('{name}'));"
    )


@pytest.mark.parametrize(
    ("items", "nominal", "tolerance"),
    [
        (((25.0, "nominal value"), (24.5, "lower limit"), (25.5, "upper limit")), 25.0,
         "24.5..25.5"),
        # Of the material, where the normals of the slope and of the top are 25 degrees apart:
        (((155.0, "nominal value"), (154.5, "lower limit"), (155.5, "upper limit")), 155.0,
         "154.5..155.5"),
        (((154.5, "lower limit"), (155.5, "upper limit")), None, "154.5..155.5"),
        (((150.0, "lower limit"), (154.0, "upper limit")), None, ""),
    ],
)  # fmt: skip
def test_an_angle_is_either_of_the_two(
    bracket: Reader, items: tuple[Any, ...], nominal: float | None, tolerance: str
) -> None:
    numbers_ = range(2620, 2620 + len(items))
    found = bracket(
        UNITS + DEGREES + "#2610=SHAPE_ASPECT('','',#4,.T.);#2611=SHAPE_ASPECT('','',#4,.T.);"
        "#2612=ANGULAR_LOCATION('angular distance','',#2610,#2611,.EQUAL.);"
        + bound(2613, 2610, 7) + bound(2614, 2611, 3)
        + "".join(_degrees(n, *item) for n, item in zip(numbers_, items, strict=True))
        + f"#2616=SHAPE_DIMENSION_REPRESENTATION('',({','.join(f'#{n}' for n in numbers_)}),#1059);"
        "#2617=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#2612,#2616);"
    )  # fmt: skip
    if not tolerance:
        assert "the angle 155 °, not that of the text" in found.drawn.left_out[2612]
        return
    (angle,) = found.drawn.drawing.between
    assert (angle.quantity, angle.nominal, angle.tolerance) == ("angle", nominal, tolerance)


@pytest.mark.parametrize(
    "entity",
    [
        "VALUE_RANGE('',(#2511,#2510))",
        "(COMPOUND_REPRESENTATION_ITEM(((#2510,#2511)))REPRESENTATION_ITEM('')VALUE_RANGE())",
    ],
)
def test_a_range_without_names_is_the_limits(bracket: Reader, entity: str) -> None:
    found = bracket(
        size(2500, 12, 12.0).replace("(#2503),#1059", "(#2512),#1059"),
        length(2510, 11.9, name=""), length(2511, 12.1, name=""), f"#2512={entity};",
    )  # fmt: skip
    (feature,) = found.drawn.drawing.feature
    assert (feature.tolerance, feature.nominal) == ("11.9..12.1", None)


def test_what_a_model_says_in_words_is_in_the_file(bracket: Reader) -> None:
    found = bracket(
        "#2500=PROPERTY_DEFINITION('semantic text','',#4);"
        "#2501=PROPERTY_DEFINITION_REPRESENTATION(#2500,#2502);"
        "#2502=REPRESENTATION('',(#2503),#1059);"
        "#2503=DESCRIPTIVE_REPRESENTATION_ITEM('semantic text','ISO 2768-mK');"
    )
    assert "# In words, which nothing here decides:\n#   ISO 2768-mK\n" in found.text


def test_an_instance_that_is_not_understood_is_listed_by_its_text(bracket: Reader) -> None:
    text = (
        "#2500=TOLERANCE_OF_TOMORROW('a','b'); #2501=DIMENSIONAL_SIZE(#9999,'diameter');"
        "#2502=FLATNESS_TOLERANCE('','',$,$);"
    )
    found = bracket(text)
    assert [each.number for each in found.pmi.unread] == [2500, 2501, 2502]
    assert "#   #2500 = TOLERANCE_OF_TOMORROW('a','b')" in found.text
    assert any("#2501 = DIMENSIONAL_SIZE" in each
               for each in FoundDrawing(found).document().warnings)  # fmt: skip


def test_the_file_is_what_measure_reads(bracket: Reader, tmp_path: Path) -> None:
    """Two bores with one position are a pattern; what is read is what was written."""
    text = (
        "#2300=SHAPE_ASPECT('','',#4,.T.);"
        + bound(2301, 2300, 12, 14)
        + length(2306, 0.05)
        + "#2303=(GEOMETRIC_TOLERANCE('','',#2306,#2300)"
        "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2135))POSITION_TOLERANCE());"
        "#2304=TOLERANCE_ZONE('',$,#4,.F.,(#2303),#2305);"
        "#2305=TOLERANCE_ZONE_FORM('cylindrical or circular');"
    )
    found = bracket(ALL_DATUMS, text, size(2200, 12, 12.0), plus_minus(2210, 2201, 0.0, 0.02))
    path = tmp_path / "drawing.toml"
    FoundDrawing(found).write("output", path)
    drawing = read_drawing(path)
    assert drawing == found.drawn.drawing
    assert drawing.pattern[0].features == ("D", "cylinder14")
    assert drawing.feature[2].tolerance == "12..12.02"


def test_a_model_without_pmi_gives_its_bores_to_fill_in(tmp_path: Path) -> None:
    result = ReadDrawing(step=EXAMPLES / "bracket.step").run()
    path = tmp_path / "drawing.toml"
    result.write("output", path)
    drawing = read_drawing(path)
    assert [(each.label, each.nominal) for each in drawing.feature] == [
        ("cylinder12", 12.0), ("cylinder13", 14.0), ("cylinder14", 8.0)
    ]  # fmt: skip
    assert "no semantic PMI" in path.read_text()


def test_a_drawing_is_read_from_the_model_itself() -> None:
    drawing = read_drawing(EXAMPLES / "bracket_pmi.step")
    assert [each.name for each in drawing.feature][:3] == ["A", "B", "C"]
    with pytest.raises(InputError, match="no semantic PMI"):
        read_drawing(EXAMPLES / "bracket.step")


def test_a_text_that_is_no_step_file(tmp_path: Path) -> None:
    path = tmp_path / "part.step"
    path.write_text("solid")
    with pytest.raises(InputError, match="ISO-10303-21"):
        read_part21(path)
