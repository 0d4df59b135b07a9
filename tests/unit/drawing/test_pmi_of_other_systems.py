"""The same PMI in the entities that other CAD programs write: read alike, or listed with a line.

The text is ours, appended to the bracket (tests/support/pmi_text.py); the ways are those that ISO
10303-242 and -47 allow in editions 1 to 4, and those of AP203 and AP214.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pretravel.base import PretravelError
from pretravel.drawing.pmi.items import Size
from pretravel.drawing.pmi.model import ModelDrawing, read_drawing
from pretravel.drawing.tasks.drawing.task import FoundDrawing
from pretravel.drawing.tolerances.iso286 import limits_of_fit
from pretravel.drawing.tolerances.tolerance_text import ToleranceText
from tests.support.pmi_text import ALL_DATUMS, FACE, bound, length, numbers, plus_minus, size
from tests.unit.drawing.conftest import Reader
from tests.unit.drawing.test_pmi_frames import ROUND_ZONE, SIZED, toleranced

CYLINDRICITY = (
    "#2300=SHAPE_ASPECT('','',#4,.T.);" + length(2302, 0.02)
    + "#2303=CYLINDRICITY_TOLERANCE('','',#2302,#2300);"
)  # fmt: skip
PROFILE = (
    "#2300=SHAPE_ASPECT('','',#4,.T.);" + length(2302, 0.5)
    + "#2303=(GEOMETRIC_TOLERANCE('','',#2302,#2300)SURFACE_PROFILE_TOLERANCE());"
)  # fmt: skip
BORE = size(2200, 12, 12.0)
POSITION = toleranced("POSITION_TOLERANCE()", 14, datums=2136) + ROUND_ZONE


def only_size(found: ModelDrawing) -> Size:
    (one,) = found.pmi.sizes
    return one


class TestFaces:
    """Face 12 is #939; it lies on the surface #439 and has the circles of its ends."""

    @pytest.mark.parametrize(
        "usage",
        [
            "GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2300,#10,#439)",  # by its surface
            "ITEM_IDENTIFIED_REPRESENTATION_USAGE('','',#2300,#10,LIST_REPRESENTATION_ITEM((#939)))",
            (
                "(GEOMETRIC_ITEM_SPECIFIC_USAGE()ITEM_IDENTIFIED_REPRESENTATION_USAGE('','',#2300,#10,"
                "#939))"
            ),
            "CHAIN_BASED_GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2300,#10,#939,(#10),())",
            (
                "GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2300,#10,#2401);"
                "#2401=COMPLEX_TRIANGULATED_FACE('',$,0,(),#939,(),(),())"
            ),  # by a tessellated face
        ],
    )
    def test_of_a_usage(self, bracket: Reader, usage: str) -> None:
        found = bracket(CYLINDRICITY, f"#2400={usage};")
        (one,) = found.pmi.tolerances
        assert numbers(found, one.place.faces) == [12]
        assert found.drawn.left_out == {}

    def test_edges_of_a_face_that_is_named_too_add_nothing(self, bracket: Reader) -> None:
        """#21 is an edge of face 1."""
        text = toleranced("FLATNESS_TOLERANCE()", 1)
        found = bracket(text, "#2400=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2300,#10,#21);")
        assert found.drawn.left_out == {}

    @pytest.mark.parametrize("bound_to", ["#15", "#16", "the name of the aspect", "#4"])
    def test_all_over(self, bracket: Reader, bound_to: str) -> None:
        """The solid, its shell, a name, the product: a profile of all 16 faces."""
        text = PROFILE
        if bound_to == "#4":
            text = text.replace("#2302,#2300)", "#2302,#4)")
        elif bound_to.startswith("#"):
            text += f"#2400=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2300,#10,{bound_to});"
        else:
            text = text.replace("SHAPE_ASPECT('',", "SHAPE_ASPECT('all over',")
        (feature,) = bracket(text).drawn.drawing.feature
        assert (feature.kind, len(feature.faces)) == ("surface", 16)

    def test_a_tolerance_of_a_size_is_of_its_feature(self, bracket: Reader) -> None:
        text = length(2302, 0.05) + (
            "#2303=(GEOMETRIC_TOLERANCE('','',#2302,#2201)"
            "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#2136))POSITION_TOLERANCE());"
        )
        found = bracket(ALL_DATUMS, SIZED, text, ROUND_ZONE)
        assert numbers(found, found.pmi.tolerances[0].place.faces) == [14]

    def test_a_size_of_a_circle_is_of_its_bore(self, bracket: Reader) -> None:
        text = BORE.replace(f"#{FACE[12]})", "#422)")
        found = bracket(text, plus_minus(2210, 2201, -0.1, 0.1))
        assert numbers(found, only_size(found).places[0].faces) == [12]

    def test_a_distance_from_a_datum(self, bracket: Reader) -> None:
        """Face 6 lies 80 mm from datum B, face 1; the axis of bore 12 lies 12 mm from it."""
        for face, nominal in ((6, 80.0), (12, 12.0)):
            text = (
                "#2500=SHAPE_ASPECT('','',#4,.T.);" + bound(2510, 2500, face)
                + "#2502=(DIMENSIONAL_LOCATION()DIRECTED_DIMENSIONAL_LOCATION()"
                "SHAPE_ASPECT_RELATIONSHIP('linear distance','',#2110,#2500));"
                + length(2203, nominal, name="nominal value")
                + "#2204=SHAPE_DIMENSION_REPRESENTATION('',(#2203),#1059);"
                "#2205=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#2502,#2204);"
            )  # fmt: skip
            found = bracket(ALL_DATUMS, text, plus_minus(2210, 2502, -0.1, 0.1))
            (relation,) = found.drawn.between
            assert (relation.nominal, relation.features[0]) == (nominal, "B")

    def test_a_distance_between_edges_is_of_the_planes_beside_them(self, bracket: Reader) -> None:
        """Edges 21 and 141, of faces 1 and 6 80 mm apart; beside both is the side y = 0."""
        text = "".join(
            f"#{2500 + k}=SHAPE_ASPECT('','',#4,.T.);"
            f"#{2510 + k}=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#{2500 + k},#10,#{edge});"
            for k, edge in enumerate((21, 141))
        )
        text += (
            "#2502=DIMENSIONAL_LOCATION('linear distance','',#2500,#2501);"
            + length(2203, 80.0, name="nominal value")
            + "#2204=SHAPE_DIMENSION_REPRESENTATION('',(#2203),#1059);"
            "#2205=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#2502,#2204);"
        )
        found = bracket(text, plus_minus(2210, 2502, -0.1, 0.1))
        (relation,) = found.drawn.between
        assert relation.features == ("plane1", "plane6")

    def test_a_datum_feature_that_is_its_size(self, bracket: Reader) -> None:
        text = (
            "#2100=DATUM('',$,#4,.F.,'A');#2101=(DATUM_FEATURE()DIMENSIONAL_SIZE(#2101,'diameter')"
            "DIMENSIONAL_SIZE_WITH_DATUM_FEATURE()SHAPE_ASPECT('',$,#4,.T.));"
            "#2102=SHAPE_ASPECT_RELATIONSHIP('',$,#2101,#2100);" + bound(2103, 2101, 12)
            + length(2203, 12.0, name="nominal value")
            + "#2204=SHAPE_DIMENSION_REPRESENTATION('',(#2203),#1059);"
            "#2205=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#2101,#2204);"
        )  # fmt: skip
        (feature,) = bracket(text, plus_minus(2210, 2101, -0.01, 0.01)).drawn.drawing.feature
        assert (feature.label, feature.tolerance) == ("A", "11.99..12.01")


def qualified(number: int, value: float, end: str) -> str:
    return (
        f"#{number}=(LENGTH_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()"
        f"MEASURE_WITH_UNIT(LENGTH_MEASURE({value}),#1060)"
        f"QUALIFIED_REPRESENTATION_ITEM((#{number + 50}))REPRESENTATION_ITEM(''));"
        f"#{number + 50}=TYPE_QUALIFIER('{end}');"
    )


def plain_value(number: int, name: str, value: float) -> str:
    return f"#{number}=VALUE_REPRESENTATION_ITEM('{name}',POSITIVE_LENGTH_MEASURE({value}));"


class TestSizes:
    @pytest.mark.parametrize(
        ("items", "text", "ends"),
        [
            ("#2203,#2220,#2221", length(2220, 12.02, name="upper bound")
             + length(2221, 11.98, name="lower bound"), (12.0, 11.98, 12.02)),
            ("#2220,#2221", plain_value(2220, "upper limit", 12.02)
             + plain_value(2221, "lower limit", 11.98), (None, 11.98, 12.02)),
            ("#2220,#2221", qualified(2220, 12.02, "maximum") + qualified(2221, 11.98, "minimum"),
             (None, 11.98, 12.02)),
            ("#2203,#2220,#2221", qualified(2220, 12.02, "maximum")
             + qualified(2221, 11.98, "minimum"), (12.0, 11.98, 12.02)),
            ("#2220", qualified(2220, 12.02, "maximum"), (12.02, None, 12.02)),
            ("#2203", ("#2400=MEASURE_QUALIFICATION('','',#2203,(#2401));"
             "#2401=TYPE_QUALIFIER('minimum');"), (12.0, 12.0, None)),
        ],
    )  # fmt: skip
    def test_limits(self, bracket: Reader, items: str, text: str, ends: Any) -> None:
        one = only_size(bracket(BORE.replace("(#2203),", f"({items}),"), text))
        assert (one.nominal, one.lower, one.upper) == ends

    @pytest.mark.parametrize(
        ("quantity", "nominal"),
        [("Diameter", 12.0), ("", 12.0), ("linear distance", 12.0), ("Radius", 6.0), ("", 6.0)],
    )
    def test_of_a_bore(self, bracket: Reader, quantity: str, nominal: float) -> None:
        """By its name in any letters, else by the diameter or the radius of the model."""
        text = size(2200, 12, nominal).replace("'diameter'", f"'{quantity}'")
        low, high = (end * nominal / 12.0 for end in (-0.1, 0.1))
        (feature,) = bracket(text, plus_minus(2210, 2201, low, high)).drawn.drawing.feature
        assert (feature.tolerance, feature.nominal) == ("11.9..12.1", 12.0)

    @pytest.mark.parametrize(
        "quantity", ["depth", "curve length", "thread diameter", "spherical diameter"]
    )
    def test_another_size_of_its_face_is_no_diameter(self, bracket: Reader, quantity: str) -> None:
        """A hole of 12 mm can be 12 mm deep; its thread is not the bore of the model."""
        text = BORE.replace("'diameter'", f"'{quantity}'") + plus_minus(2210, 2201, -0.1, 0.1)
        (one,) = bracket(text).drawn.not_decided
        assert (one.characteristic, one.limits) == (quantity, "11.9..12.1")
        assert f"a {quantity} of a cylinder" in one.reason

    @pytest.mark.parametrize(
        "fit", ["'H','hole','7',''", "'H7','','',''", "'','H','IT 7',''", "'h','hole','IT7',''"]
    )
    def test_the_class_of_a_fit(self, bracket: Reader, fit: str) -> None:
        text = f"#2210=LIMITS_AND_FITS({fit});#2211=PLUS_MINUS_TOLERANCE(#2210,#2201);"
        one = only_size(bracket(BORE, text))
        assert (one.fit, one.lower, one.upper) == ("H7", 12.0, 12.018)

    @pytest.mark.parametrize(
        ("text", "reason"),
        [
            (plus_minus(2210, 2201, 0.1, 0.1), "both deviations are +0.1 mm"),
            (plus_minus(2210, 2201, -0.1, 0.1) + plus_minus(2410, 2201, -0.2, 0.2),
             "several pairs of deviations"),
        ],
    )  # fmt: skip
    def test_deviations_that_contradict_have_a_line(
        self, bracket: Reader, text: str, reason: str
    ) -> None:
        (one,) = bracket(BORE, text).drawn.not_decided
        assert (one.feature, one.characteristic) == ("face 12 (#2201)", "diameter")
        assert reason in one.reason

    @pytest.mark.parametrize(
        ("note", "association"),
        [("maximum inscribed association criterion", "inscribed"), ("free state", None)],
    )
    def test_the_association_that_is_asked_for(
        self, bracket: Reader, tmp_path: Path, note: str, association: str | None
    ) -> None:
        text = BORE.replace("(#2203),", "(#2203,#2220),") + plus_minus(2210, 2201, -0.1, 0.1)
        found = bracket(
            text, f"#2220=DESCRIPTIVE_REPRESENTATION_ITEM('dimensional note','{note}');"
        )
        (feature,) = found.drawn.features
        assert feature.drawn.association == association
        assert feature.remarks == [f"size: {note}"]
        path = tmp_path / "drawing.toml"
        path.write_text(found.text)
        assert read_drawing(path) == found.drawn.drawing

    @pytest.mark.parametrize(
        ("face", "association", "limits"),
        [(12, "inscribed", "11.9.."), (13, "circumscribed", "..14.1")],
    )
    def test_an_envelope_is_of_what_fits_in_or_around(
        self, bracket: Reader, face: int, association: str, limits: str
    ) -> None:
        """ISO 14405-1, (E): at the limit of most material a second size, beside the first."""
        nominal = {12: 12.0, 13: 14.0}[face]
        text = size(2200, face, nominal).replace("(#2203),", "(#2203,#2220),")
        note = "#2220=DESCRIPTIVE_REPRESENTATION_ITEM('dimensional note','envelope requirement');"
        found = bracket(text, plus_minus(2210, 2201, -0.1, 0.1), note)
        sized, envelope = found.drawn.drawing.feature
        assert (sized.association, sized.label) == (None, f"cylinder{face}")
        assert sized.tolerance == f"{nominal - 0.1:.10g}..{nominal + 0.1:.10g}"
        assert (envelope.association, envelope.tolerance) == (association, limits)
        assert (envelope.label, envelope.faces) == (f"cylinder{face}_envelope", (face,))
        assert found.drawn.left_out == {}

    def test_an_envelope_of_a_width(self, bracket: Reader) -> None:
        """Faces 1 and 6 are the ends of the bracket, 9 and 11 the walls of its slot."""
        for first, second, association in ((1, 6, "circumscribed"), (9, 11, "inscribed")):
            text = (
                size(2200, first, 80.0 if first == 1 else 40.0)
                .replace(
                    bound(2202, 2200, first),
                    f"#2202=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2200,#10,#{FACE[first]});"
                    f"#2222=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#2200,#10,#{FACE[second]});",
                )
                .replace("(#2203),", "(#2203,#2220),")
                .replace("'diameter'", "'width'")
            )
            note = "#2220=DESCRIPTIVE_REPRESENTATION_ITEM('','envelope requirement');"
            found = bracket(text, plus_minus(2210, 2201, -0.1, 0.1), note)
            assert [each.association for each in found.drawn.drawing.feature] == [
                None, association]  # fmt: skip

    def test_a_size_of_sections_has_a_line(self, bracket: Reader) -> None:
        text = BORE.replace("(#2203),", "(#2203,#2220),") + plus_minus(2210, 2201, -0.1, 0.1)
        note = "#2220=DESCRIPTIVE_REPRESENTATION_ITEM('dimensional note','any cross section');"
        (one,) = bracket(text, note).drawn.not_decided
        assert "'any cross section' is not decided" in one.reason


@pytest.mark.parametrize(
    ("nominal", "fit", "ends"),
    [  # ISO 286-2:2010
        (20.0, "H13", (20.0, 20.33)), (20.0, "js14", (19.74, 20.26)), (60.0, "r6", (60.041, 60.06)),
        (70.0, "r6", (70.043, 70.062)), (40.0, "s6", (40.043, 40.059)),
        (60.0, "S7", (59.928, 59.958)),  # −53 + 11: the step from IT6 to IT7
        (8.0, "P9", (7.949, 7.985)), (8.0, "N9", (7.964, 8.0)), (8.0, "M9", (7.958, 7.994)),
        (3.0, "P9", (2.969, 2.994)), (3.0, "N9", (2.971, 2.996)), (3.0, "N7", (2.986, 2.996)),
        (16.0, "P9", (15.939, 15.982)),
    ],
)  # fmt: skip
def test_further_classes(nominal: float, fit: str, ends: tuple[float, float]) -> None:
    assert limits_of_fit(nominal, fit) == ends


@pytest.mark.parametrize(
    ("kind", "fit", "other"),
    [("boss", "42G6", "g6"), ("bore", "20h6", "H6"), ("slot", "8p9", "P9")],
)
def test_a_class_of_the_other_side_is_refused(kind: str, fit: str, other: str) -> None:
    with pytest.raises(PretravelError, match=f"is {other} meant"):
        ToleranceText.parse(fit).refuse_other_side(kind)
    ToleranceText.parse(f"{fit[:-2]}{other}").refuse_other_side(kind)


class TestFrames:
    def test_a_common_datum_of_ap203(self, bracket: Reader) -> None:
        text = (
            "#2160=COMMON_DATUM('',$,#4,.F.,'A-B');"
            "#2161=SHAPE_ASPECT_RELATIONSHIP('',$,#2160,#2110);"
            "#2162=SHAPE_ASPECT_RELATIONSHIP('',$,#2160,#2100);#2163=DATUM_REFERENCE(1,#2160);"
        )
        found = bracket(
            ALL_DATUMS, text, toleranced("POSITION_TOLERANCE()", 14, datums=2163), ROUND_ZONE
        )
        assert [each.letter for each in found.pmi.datums] == ["A", "B", "D"]
        (tolerance,) = found.pmi.tolerances
        assert [each.letters for each in tolerance.datums] == [("A", "B")]
        assert found.drawn.left_out == {}

    def test_a_letter_that_looks_like_a_common_datum(self, bracket: Reader) -> None:
        """Its label has no sign that frames give a meaning."""
        text = ALL_DATUMS.replace("#2100=DATUM('',$,#4,.F.,'A')", "#2100=DATUM('',$,#4,.F.,'A-1 ')")
        found = bracket(text, toleranced("POSITION_TOLERANCE()", 14, datums=2135), ROUND_ZONE)
        assert found.pmi.datums[0].letter == "A-1"
        assert found.drawn.drawing.feature[-1].geometric[0].datums == ("A_1",)

    @pytest.mark.parametrize(
        "definition",
        [
            "NON_UNIFORM_ZONE_DEFINITION(#2304,())",
            "PROJECTED_ZONE_DEFINITION_WITH_OFFSET(#2304,(),#2300,#2302,#2302)",
            (
                "RUNOUT_ZONE_DEFINITION(#2304,(),#2308);#2308=RUNOUT_ZONE_ORIENTATION(#2309);"
                "#2309=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.5),#2004)"
            ),
            "TOLERANCE_ZONE_WITH_DATUM('',$,#4,.F.,(#2303),#2305,#2135)",
        ],
    )
    def test_another_zone_has_a_line(self, bracket: Reader, definition: str) -> None:
        """It was decided as the plain zone."""
        found = bracket(ALL_DATUMS, SIZED, POSITION, f"#2307={definition};")
        assert not any(each.geometric for each in found.drawn.drawing.feature)
        (one,) = found.drawn.not_decided
        assert "#2307" in one.reason

    def test_a_complex_projected_zone(self, bracket: Reader) -> None:
        text = (
            "#2307=(PROJECTED_ZONE_DEFINITION(#2308,#2309)TOLERANCE_ZONE_DEFINITION(#2304,()));"
            "#2308=SHAPE_ASPECT('','',#4,.T.);" + bound(2320, 2308, 3) + length(2309, 25.0)
        )
        found = bracket(ALL_DATUMS, SIZED, POSITION, text)
        assert found.pmi.tolerances[0].projected == 25.0

    def test_two_datum_systems_have_a_line(self, bracket: Reader) -> None:
        """They were read as one."""
        text = toleranced("POSITION_TOLERANCE()", 14, datums=2135).replace("#2135", "#2135,#2140")
        found = bracket(ALL_DATUMS, text, ROUND_ZONE, SIZED)
        assert "|".join(each.text for each in found.pmi.tolerances[0].datums) == "A"
        assert "and to D-B" in found.drawn.not_decided[0].reason

    @pytest.mark.parametrize(
        ("entity", "datums"), [("FLATNESS_TOLERANCE()", None), ("PARALLELISM_TOLERANCE()", 2135)]
    )
    def test_one_zone_of_several_planes_has_a_line(
        self, bracket: Reader, entity: str, datums: int | None
    ) -> None:
        """Each of them by itself can be flat enough where they are not together."""
        signs = "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.COMMON_ZONE.))"
        found = bracket(ALL_DATUMS, toleranced(signs + entity, 2, 3, datums=datums))
        assert "one zone (CZ)" in found.drawn.left_out[2303]
        assert not any(each.form or each.geometric for each in found.drawn.features)

    def test_the_same_tolerance_of_both_halves_of_a_surface_is_one(self, bracket: Reader) -> None:
        """As the run-outs of CTC 5 of NIST."""
        texts = [
            toleranced("PERPENDICULARITY_TOLERANCE()", 2, zone=zone, datums=2135, number=number)
            for number, zone in ((2300, 0.1), (2310, 0.1), (2320, 0.2))
        ]
        found = bracket(ALL_DATUMS, *texts)
        (zones,) = ([g.zone for g in each.geometric] for each in found.drawn.features
                    if each.geometric)  # fmt: skip
        assert (zones, found.drawn.left_out) == ([0.1, 0.2], {})

    def test_two_datums_of_one_letter_have_a_line(self, bracket: Reader) -> None:
        """Of two parts of an assembly: it is not guessed which one is meant."""
        other = (
            "#2900=DATUM('',$,#4,.F.,'A');#2901=DATUM_FEATURE('',$,#4,.T.);"
            "#2902=SHAPE_ASPECT_RELATIONSHIP('',$,#2901,#2900);"
        )
        text = toleranced("PERPENDICULARITY_TOLERANCE()", 2, datums=2135)
        found = bracket(ALL_DATUMS, other, bound(2903, 2901, 6), text)
        assert set(found.drawn.left_out) == {2100, 2900, 2303}
        (one,) = found.drawn.not_decided
        assert "several datums A" in one.reason

    def test_threads_and_holes_that_are_not_read_are_listed(self, bracket: Reader) -> None:
        text = "#2500=THREAD('M8','',#4,.T.);#2501=BASIC_ROUND_HOLE('','',#4);"
        assert [each.number for each in bracket(text).pmi.unread] == [2500, 2501]

    def test_a_statistical_tolerance_is_decided_with_a_remark(self, bracket: Reader) -> None:
        text = POSITION.replace(
            "POSITION_TOLERANCE", "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.STATISTICAL_TOLERANCE.))"
            "POSITION_TOLERANCE",
        )  # fmt: skip
        found = bracket(ALL_DATUMS, SIZED, text).drawn.drawing.feature
        assert [one.remark for each in found for one in each.geometric] == ["statistical (ST)"]

    def test_the_form_of_a_zone_in_any_letters_or_none(self, bracket: Reader) -> None:
        for form, instead in (("'Cylindrical or Circular'", ""), ("$", "a zone between planes")):
            text = POSITION.replace("'cylindrical or circular'", form)
            found = bracket(ALL_DATUMS, SIZED, text).drawn.drawing.feature
            assert [one.instead_of for each in found for one in each.geometric] == [instead]

    def test_a_relation_of_tolerances_without_its_values_is_listed(self, bracket: Reader) -> None:
        text = "#2390=(GEOMETRIC_TOLERANCE_RELATIONSHIP());"
        found = bracket(ALL_DATUMS, SIZED, POSITION, text)
        assert [each.number for each in found.pmi.unread if each.is_tolerance] == [2390]


class TestNothingIsLost:
    def test_tolerances_of_a_hole_have_a_line(self, bracket: Reader) -> None:
        text = (
            "#2401=COUNTERBORE_HOLE_DEFINITION('','',#4,.T.,12.0,#2402,$);"
            + length(2410, -0.1) + length(2411, 0.1) + "#2402=TOLERANCE_VALUE(#2410,#2411);"
        )  # fmt: skip
        found = bracket(text)
        assert [each.number for each in found.pmi.unread] == [2401, 2402]
        (one,) = found.drawn.not_decided
        assert "COUNTERBORE_HOLE_DEFINITION" in one.reason

    def test_a_table_of_general_tolerances_has_a_line(self, bracket: Reader) -> None:
        (one,) = bracket("#2401=DEFAULT_TOLERANCE_TABLE('',(),#1059);").drawn.not_decided
        assert "DEFAULT_TOLERANCE_TABLE" in one.reason

    @pytest.mark.parametrize(
        "broken",
        [
            "#2390=(FLATNESS_TOLERANCE()GEOMETRIC_TOLERANCE('',&,#4));",
            "#2390=SHAPE_ASPECT_RELATIONSHIP('',$);",
            "#2390=GEOMETRIC_ITEM_SPECIFIC_USAGE('');",
            "#2390=<other.stp#flange>;",  # a reference of Part 21 edition 3
        ],
    )
    def test_a_line_that_is_broken_does_not_lose_the_others(
        self, bracket: Reader, broken: str
    ) -> None:
        found = bracket(BORE, plus_minus(2210, 2201, -0.1, 0.1), broken)
        assert len(found.drawn.features) == 1
        listed = [each.number for each in found.pmi.unread]
        assert listed == ([2390] if "TOLERANCE" in broken else [])

    def test_drawn_annotations_alone(self, bracket: Reader) -> None:
        found = bracket("#2400=ANNOTATION_OCCURRENCE('',(),#4);#2401=DRAUGHTING_CALLOUT('',());")
        verdict = FoundDrawing(found).document().verdict
        assert "but 2 annotations for people to read: export it with semantic PMI" in verdict
