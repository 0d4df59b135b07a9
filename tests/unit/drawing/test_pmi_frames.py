"""Frames of the PMI: what is decided as stated, what by a stricter tolerance, what has a line.

The text is ours, appended to the bracket (tests/support/pmi_text.py).
"""

from __future__ import annotations

from typing import Any

import pytest

from pretravel.drawing.pmi.model import ModelDrawing
from pretravel.drawing.tolerances.features_file import DrawnFeature
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance
from tests.support.pmi_text import ALL_DATUMS, bound, length, numbers, plus_minus, size
from tests.unit.drawing.conftest import Reader

ROUND_ZONE = (
    "#2304=TOLERANCE_ZONE('',$,#4,.F.,(#2303),#2305);"
    "#2305=TOLERANCE_ZONE_FORM('cylindrical or circular');"
)
SIZED = (
    size(2200, 14, 8.0) + plus_minus(2210, 2201, -0.01, 0.03)
    + size(2220, 12, 12.0) + plus_minus(2230, 2221, 0.0, 0.02)
)  # fmt: skip
"""Limits of the bores 14 and 12; 12 is datum D."""


def toleranced(
    entities: str, *faces: int, zone: float = 0.1, datums: int | None = None, number: int = 2300
) -> str:
    """A tolerance of faces as a complex instance; number + 3 is the tolerance."""
    to = f"GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#{datums}))" if datums else ""
    return (
        f"#{number}=SHAPE_ASPECT('','',#4,.T.);"
        + bound(number + 4000, number, *faces)
        + length(number + 2, zone)
        + f"#{number + 3}=(GEOMETRIC_TOLERANCE('','',#{number + 2},#{number}){to}{entities});"
    )


def only(found: ModelDrawing) -> tuple[DrawnFeature, GeometricTolerance]:
    """The feature with a tolerance to datums or of form, and this tolerance."""
    ((feature, (tolerance,)),) = (
        (each, each.geometric) for each in found.drawn.drawing.feature if each.geometric
    )
    assert found.drawn.left_out == {}
    return feature, tolerance


class TestUnequallyDisposed:
    """0.1 mm wide, displacement 0.02 mm."""

    TEXT = toleranced(
        "UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE(#2310)SURFACE_PROFILE_TOLERANCE()", 3
    ) + length(2310, 0.02)

    @pytest.mark.parametrize(
        ("standard", "offset"),
        [
            ("ASME Y14.5-2009", 0.02 - 0.05),  # 0.02 of the zone lies outside
            ("ISO 1101:2017", 0.02),  # its middle lies 0.02 outside
        ],
    )
    def test_by_the_standard_of_the_drawing(
        self, bracket: Reader, standard: str, offset: float
    ) -> None:
        document = f"#2390=DOCUMENT('{standard}','','',#2391);#2391=DOCUMENT_TYPE('');"
        feature, tolerance = only(bracket(self.TEXT, document))
        assert (feature.faces, tolerance.zone) == ((3,), 0.1)
        assert tolerance.offset == pytest.approx(offset, abs=1e-9)

    def test_without_a_standard_it_has_a_line_with_both(self, bracket: Reader) -> None:
        found = bracket(self.TEXT)
        (one,) = found.drawn.not_decided
        assert one.characteristic == "profile (U 0.02)"
        assert "-0.03 by ASME" in one.reason
        assert "0.02 by ISO" in one.reason


def test_in_the_free_state(bracket: Reader) -> None:
    text = toleranced(
        "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.FREE_STATE.))SURFACE_PROFILE_TOLERANCE()", 3
    )
    _, tolerance = only(bracket(text))
    assert tolerance.remark == "in the free state (F)"


@pytest.mark.parametrize(
    ("entities", "face", "kind", "instead_of"),
    [
        ("ROUNDNESS_TOLERANCE()", 12, "roundness", ""),
        ("STRAIGHTNESS_TOLERANCE()", 3, "flatness", "the straightness of each line"),
        ("STRAIGHTNESS_TOLERANCE()", 13, "cylindricity", "the straightness of each line"),
        ("LINE_PROFILE_TOLERANCE()", 3, "profile", "the profile of each line"),
        ("FLATNESS_TOLERANCE()GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT(#2310)", 3, "flatness",
         "on each 25 mm"),
    ],
)  # fmt: skip
def test_forms(bracket: Reader, entities: str, face: int, kind: str, instead_of: str) -> None:
    feature, tolerance = only(bracket(toleranced(entities, face) + length(2310, 25.0)))
    assert feature.faces == (face,)
    assert (tolerance.kind, tolerance.instead_of) == (kind, instead_of)


@pytest.mark.parametrize(
    ("entities", "face"), [("FLATNESS_TOLERANCE()", 3), ("CYLINDRICITY_TOLERANCE()", 12)]
)
def test_the_form_of_a_whole_feature(bracket: Reader, entities: str, face: int) -> None:
    found = bracket(toleranced(entities, face, zone=0.02))
    (feature,) = found.drawn.drawing.feature
    assert (feature.faces, feature.form_tolerance) == ((face,), 0.02)


def test_a_profile_of_the_whole_part(bracket: Reader) -> None:
    text = length(2302, 0.4) + (
        "#2303=(GEOMETRIC_TOLERANCE('','',#2302,#4)"
        "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2135))SURFACE_PROFILE_TOLERANCE());"
    )
    found = bracket(ALL_DATUMS, text)
    feature, tolerance = only(found)
    assert (feature.kind, len(feature.faces)) == ("surface", len(found.part.faces))
    assert tolerance.datums == ("A",)


class TestMaterial:
    def test_without_limits_of_the_size(self, bracket: Reader) -> None:
        """A zone that cannot grow is the stricter one."""
        text = toleranced(
            "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.MAXIMUM_MATERIAL_REQUIREMENT.))"
            "POSITION_TOLERANCE()", 14, datums=2135,
        )  # fmt: skip
        _, tolerance = only(bracket(ALL_DATUMS, text, ROUND_ZONE))
        assert tolerance.material == ""
        assert tolerance.instead_of == "(M), without limits of the size"

    def test_a_largest_value(self, bracket: Reader) -> None:
        text = toleranced(
            "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.MAXIMUM_MATERIAL_REQUIREMENT.))"
            "GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE(#2310)POSITION_TOLERANCE()",
            14, datums=2135,
        )  # fmt: skip
        found = bracket(ALL_DATUMS, text, ROUND_ZONE, SIZED, length(2310, 0.3))
        _, tolerance = only(found)
        assert (tolerance.material, tolerance.instead_of) == ("", "(M) at most 0.3 mm")

    def test_several_datums_at_maximum_material(self, bracket: Reader) -> None:
        """As they are: one of the frames that their material sizes allow."""
        more = (
            "#2141=DATUM_REFERENCE_COMPARTMENT('',$,#4,.F.,#2110,"
            "(SIMPLE_DATUM_REFERENCE_MODIFIER(.LEAST_MATERIAL_REQUIREMENT.)));"
            "#2142=DATUM_SYSTEM('',$,#4,.F.,(#2130,#2132,#2141));"
        )
        text = toleranced("POSITION_TOLERANCE()", 14, datums=2142)
        _, tolerance = only(bracket(ALL_DATUMS, more, text, ROUND_ZONE, SIZED))
        assert tolerance.datums == ("A", "D", "B")
        assert tolerance.instead_of == "datums A|D(M)|B(L)"

    def test_one_datum_at_maximum_material_shifts(self, bracket: Reader) -> None:
        text = toleranced("POSITION_TOLERANCE()", 14, datums=2136)
        _, tolerance = only(bracket(ALL_DATUMS, text, ROUND_ZONE, SIZED))
        assert (tolerance.datums, tolerance.instead_of) == (("A", "D(M)", "B"), "")

    def test_a_datum_with_another_modifier_has_a_line(self, bracket: Reader) -> None:
        more = (
            "#2141=DATUM_REFERENCE_COMPARTMENT('',$,#4,.F.,#2110,"
            "(SIMPLE_DATUM_REFERENCE_MODIFIER(.TRANSLATION.)));"
            "#2142=DATUM_SYSTEM('',$,#4,.F.,(#2130,#2141));"
        )
        text = toleranced("POSITION_TOLERANCE()", 14, datums=2142)
        (one,) = bracket(ALL_DATUMS, more, text, ROUND_ZONE).drawn.not_decided
        assert one.characteristic == "position to A|B(translation)"
        assert "datum B(translation) has a modifier" in one.reason


@pytest.mark.parametrize(
    ("zone_form", "instead_of"),
    [
        ("within a cylinder", ""),
        ("between two parallel planes", "a zone between planes"),
        (None, "a zone between planes"),
    ],
)
def test_the_zone_of_an_axis(bracket: Reader, zone_form: str | None, instead_of: str) -> None:
    """A cylinder lies within the zone between two planes of the same width."""
    text = toleranced("POSITION_TOLERANCE()", 14, datums=2136)
    form = "" if zone_form is None else ROUND_ZONE.replace("cylindrical or circular", zone_form)
    _, tolerance = only(bracket(ALL_DATUMS, text, form, SIZED))
    assert tolerance.instead_of == instead_of


def test_a_projected_zone_begins_at_its_face(bracket: Reader) -> None:
    """Bore 14 reaches from z = 0 to 20; from the top, face 3, 25 mm away from the part."""
    text = toleranced("POSITION_TOLERANCE()", 14, datums=2136)
    projected = (
        "#2307=PROJECTED_ZONE_DEFINITION(#2304,(),#2308,#2309);"
        "#2308=SHAPE_ASPECT('','',#4,.T.);" + bound(2320 + 4000, 2308, 3) + length(2309, 25.0)
    )
    feature, tolerance = only(bracket(ALL_DATUMS, text, ROUND_ZONE, projected, SIZED))
    assert feature.at is not None
    assert feature.axis is not None
    assert tolerance.between is not None
    ends = [feature.at[2] + feature.axis[2] * end for end in tolerance.between]
    assert ends == pytest.approx([20.0, 45.0])


def test_a_composite_frame(bracket: Reader) -> None:
    """Its lower segment turns the pattern, and does not place it: placed is stricter."""
    upper = toleranced("POSITION_TOLERANCE()", 12, 14, zone=0.2, datums=2136)
    lower = toleranced("POSITION_TOLERANCE()", 12, 14, zone=0.05, datums=2135, number=2350)
    both = (
        "#2390=GEOMETRIC_TOLERANCE_RELATIONSHIP('composite','',#2303,#2353);"
        + ROUND_ZONE.replace("(#2303)", "(#2303,#2353)")
    )
    # Datum D is bore 12, which cannot be a datum of itself: that is said when it is measured.
    found = bracket(ALL_DATUMS, upper, lower, both, SIZED)
    first, second = found.drawn.drawing.pattern
    assert (first.position_tolerance, first.instead_of) == (0.2, "")
    assert second.position_tolerance == 0.05
    assert second.instead_of == "the lower segment of a composite frame"
    assert not {2390} & {each.number for each in found.pmi.unread}


def test_another_relation_of_tolerances_is_listed(bracket: Reader) -> None:
    upper = toleranced("POSITION_TOLERANCE()", 12, 14, zone=0.2, datums=2135)
    found = bracket(
        ALL_DATUMS, upper, ROUND_ZONE,
        "#2390=GEOMETRIC_TOLERANCE_RELATIONSHIP('simultaneity','',#2303,#2303);",
    )  # fmt: skip
    assert [each.number for each in found.pmi.unread if each.is_tolerance] == [2390]
    (one,) = found.drawn.not_decided
    assert one.feature == "#2390"


def test_separate_requirements_are_no_pattern(bracket: Reader) -> None:
    text = toleranced(
        "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.SEPARATE_REQUIREMENT.))POSITION_TOLERANCE()",
        13, 14, datums=2135,
    )  # fmt: skip
    drawing = bracket(ALL_DATUMS, text, ROUND_ZONE).drawn.drawing
    assert drawing.pattern == ()
    assert [len(each.geometric) for each in drawing.feature if each.faces in ((13,), (14,))] == [
        1,
        1,
    ]


def test_a_tolerance_that_is_not_understood_has_a_line(bracket: Reader) -> None:
    found = bracket("#2502=FLATNESS_TOLERANCE('','',$,#9999);")
    (one,) = found.drawn.not_decided
    assert (one.feature, one.characteristic) == ("#2502", "not understood")
    assert "FLATNESS_TOLERANCE('','',$,#9999)" in one.reason
    assert "[[not_decided]]" in found.text


class TestSizes:
    @pytest.mark.parametrize(("qualifier", "limits"), [("maximum", "..12"), ("minimum", "12..")])
    def test_one_limit_alone(self, bracket: Reader, qualifier: str, limits: str) -> None:
        """12 MAX: the value is the limit."""
        text = size(2200, 12, 12.0).replace(
            "REPRESENTATION_ITEM('nominal value')",
            "QUALIFIED_REPRESENTATION_ITEM((#2240))REPRESENTATION_ITEM('nominal value')",
        )
        (feature,) = bracket(text, f"#2240=TYPE_QUALIFIER('{qualifier}');").drawn.drawing.feature
        assert feature.tolerance == limits

    def test_a_radius(self, bracket: Reader) -> None:
        text = size(2200, 12, 6.0).replace("'diameter'", "'radius'")
        (feature,) = bracket(text, plus_minus(2210, 2201, -0.1, 0.2)).drawn.drawing.feature
        assert (feature.tolerance, feature.nominal) == ("11.8..12.4", 12.0)

    def test_a_distance_between_faces(self, bracket: Reader) -> None:
        """Planes 1 and 6 are 80 mm apart."""
        text = (
            "#2200=SHAPE_ASPECT('','',#4,.T.);#2250=SHAPE_ASPECT('','',#4,.T.);"
            "#2201=DIMENSIONAL_LOCATION('linear distance','',#2200,#2250);"
            + bound(2260, 2200, 1) + bound(2270, 2250, 6) + length(2203, 80.0, name="nominal value")
            + "#2204=SHAPE_DIMENSION_REPRESENTATION('',(#2203),#1059);"
            "#2205=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#2201,#2204);"
        )  # fmt: skip
        found = bracket(text, plus_minus(2210, 2201, -0.3, 0.1))
        (relation,) = found.drawn.between
        assert (relation.tolerance, relation.nominal) == ("79.7..80.1", 80.0)
        (one,) = found.pmi.sizes
        assert [numbers(found, place.faces) for place in one.places] == [[1], [6]]

    def test_an_angle_between_faces_in_radians(self, bracket: Reader) -> None:
        """Face 7 leans by 25° (examples/data/README.md): cos 25° = 0.9063."""
        angle = (
            "#{number}=(MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT("
            "PLANE_ANGLE_MEASURE({value}),#2004)PLANE_ANGLE_MEASURE_WITH_UNIT()"
            "REPRESENTATION_ITEM('{name}'));"
        )
        text = (
            "#2200=SHAPE_ASPECT('','',#4,.T.);#2250=SHAPE_ASPECT('','',#4,.T.);"
            "#2201=ANGULAR_LOCATION('','',#2200,#2250,.SMALL.);"
            + bound(2260, 2200, 3) + bound(2270, 2250, 7)
            + angle.format(number=2203, value=0.4363323129985824, name="nominal value")
            + angle.format(number=2206, value=0.43807764225057757, name="upper limit")
            + angle.format(number=2207, value=0.43458698374658716, name="lower limit")
            + "#2204=SHAPE_DIMENSION_REPRESENTATION('',(#2203,#2206,#2207),#1059);"
            "#2205=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#2201,#2204);"
        )  # fmt: skip
        (relation,) = bracket(ALL_DATUMS, text).drawn.between
        assert (relation.quantity, relation.nominal) == ("angle", 25.0)
        assert relation.tolerance == "24.9..25.1"

    def test_millimetres_in_a_model_in_inches(self, bracket: Reader) -> None:
        """The geometry is in inches then: 25.4 times as large; the size of the PMI is in mm."""
        found = bracket(
            ALL_DATUMS, size(2200, 12, 304.8), plus_minus(2210, 2201, -0.2, 0.1),
            replaced={"ASSIGNED_CONTEXT((#1060,": "ASSIGNED_CONTEXT((#2001,"},
        )  # fmt: skip
        (one,) = found.pmi.sizes
        assert (one.nominal, one.lower, one.upper) == (304.8, 304.6, 304.9)
        assert 2.0 * found.faces[one.places[0].faces[0]].radius == pytest.approx(304.8)


@pytest.mark.parametrize(
    ("reference", "text"),
    [
        # AP203 and AP214: by precedence, the second first.
        ("GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2152,#2151))", "A|D(M)"),
        # AP242: the system of compartments.
        ("GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2153))", "A|D(M)"),
    ],
)
def test_spellings_of_datum_systems(bracket: Reader, reference: str, text: str) -> None:
    more = (
        "#2151=DATUM_REFERENCE(1,#2100);"
        "#2152=REFERENCED_MODIFIED_DATUM(2,#2120,.MAXIMUM_MATERIAL_CONDITION.);"
        "#2153=DATUM_SYSTEM('',$,#4,.F.,(#2130,#2132));"
    )
    tolerance = toleranced(f"{reference}POSITION_TOLERANCE()", 14)
    (one,) = bracket(ALL_DATUMS, more, tolerance, ROUND_ZONE).pmi.tolerances
    assert "|".join(each.text for each in one.datums) == text


def test_datums_and_their_features_by_every_relation(bracket: Reader) -> None:
    """A datum feature of a whole (2 sides of a slot), and a relation written the other way."""
    text = (
        "#2100=DATUM('',$,#4,.F.,'A');#2101=DATUM_FEATURE('',$,#4,.T.);"
        "#2102=SHAPE_ASPECT_RELATIONSHIP('',$,#2100,#2101);" + bound(2103, 2101, 5)
        + "#2110=DATUM('',$,#4,.F.,'B');"
        "#2111=(COMPOSITE_SHAPE_ASPECT()DATUM_FEATURE()SHAPE_ASPECT('',$,#4,.T.));"
        "#2112=SHAPE_ASPECT_RELATIONSHIP('',$,#2111,#2110);"
        "#2113=SHAPE_ASPECT('',$,#4,.T.);#2114=SHAPE_ASPECT('',$,#4,.T.);"
        "#2115=SHAPE_ASPECT_RELATIONSHIP('',$,#2111,#2113);"
        "#2116=SHAPE_ASPECT_RELATIONSHIP('',$,#2111,#2114);"
        + bound(2117, 2113, 9) + bound(2118, 2114, 11)
    )  # fmt: skip
    found = bracket(text)
    letters: dict[str, Any] = {
        each.letter: numbers(found, each.place.faces) for each in found.pmi.datums
    }
    assert letters == {"A": [5], "B": [9, 11]}
