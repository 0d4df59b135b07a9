"""QIF files: units, tip centres, the order of the schema."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import FilePositions, FileReadings
from pretravel.files.format_registry import format_of
from pretravel.files.logs.qif import read_point_sets, read_qif, write_qif
from pretravel.files.touches_csv import read_touches
from pretravel.touches import Touches
from tests.support.control_logs import (
    QIF_FILE,
    written,
)
from tests.support.examples import EXAMPLES


def example_touches() -> Touches:
    touches = read_touches(EXAMPLES / "part_touches.csv")
    return replace(touches, labels=tuple(f"p{i + 1}" for i in range(len(touches))))


MM = (
    "<FileUnits><PrimaryUnits><LinearUnit><UnitName>mm</UnitName><UnitConversion><Factor>0.001"
    "</Factor></UnitConversion></LinearUnit></PrimaryUnits></FileUnits>"
)


THOU = "<UnitName>thou</UnitName><UnitConversion><Factor>0.0000254</Factor></UnitConversion>"


class TestQif:
    def test_uncompensated_points(self, tmp_path: Path) -> None:
        found = read_qif(written(tmp_path, QIF_FILE.replace("UNITS", MM), "a.qif"))
        assert isinstance(found, FileReadings)
        assert found.touches.positions.tolist() == [[0, 0, 3], [10, 0, 3]]
        assert found.touches.labels == ("7-1", "7-2")
        assert found.tip_radius == 2.5

    def test_comments_among_the_numbers_and_before_the_document(self, tmp_path: Path) -> None:
        """The official sample of points begins each list with a comment."""
        text = QIF_FILE.replace("UNITS", MM)
        text = text.replace("<Points>0 0 3", "<!-- a 1 --><Points><!-- of 5 -->0 0<!-- b --> 3")
        text = text.replace("<QIFDocument", "<!--" + "\nlicence" * 200 + "-->\n<QIFDocument")
        path = written(tmp_path, text, "a.txt")
        assert format_of(path).name == "qif"
        assert read_point_sets(path)[0].points.tolist() == [[0, 0, 3], [10, 0, 3]]

    def test_points_have_the_lines_of_the_file(self, tmp_path: Path) -> None:
        text = QIF_FILE.replace("UNITS", MM + "\n\n")
        text = text.replace("<Points>0 0 3", "<Points>\n<!-- a\nb --> 0\n0 3")
        (found,) = read_point_sets(written(tmp_path, text))
        assert found.lines == (5, 6)
        assert text.split("\n")[4].endswith("--> 0")
        readings = read_qif(tmp_path / "file.txt")
        assert isinstance(readings, FileReadings)
        assert readings.touches.lines == (5, 6)

    @pytest.mark.parametrize("encoding", ["utf-16", "iso-8859-1"])
    def test_encodings(self, tmp_path: Path, encoding: str) -> None:
        text = QIF_FILE.replace("UNITS", MM + "<!-- Prüfung -->")
        text = text.replace('version="1.0"', f'version="1.0" encoding="{encoding}"')
        found = read_point_sets(written(tmp_path, text.encode(encoding)))
        assert found[0].points[1].tolist() == [10, 0, 3]

    def test_version_2(self, tmp_path: Path) -> None:
        point = (
            '<MeasurePoint id="{id}"><Point>{x} 0 3</Point>{normal}<Compensated>false</Compensated>'
            "<ProbeRadius>2.5</ProbeRadius></MeasurePoint>"
        )
        normal = "<Normal>0 0 1</Normal>"

        def document(*points: str) -> str:
            return (
                '<QIFDocument xmlns="http://qifstandards.org/xsd/qif2" versionQIF="2.1.0">'
                f"{MM}<MeasurementResults><PlaneFeatureActual><PointList>{''.join(points)}"
                "</PointList></PlaneFeatureActual></MeasurementResults></QIFDocument>"
            )

        bare = document(point.format(id=7, x=1, normal=""), point.format(id=8, x=2, normal=normal))
        positions = read_qif(written(tmp_path, bare))
        assert isinstance(positions, FilePositions)
        assert positions.positions.tolist() == [[1, 0, 3], [2, 0, 3]]
        full = document(point.format(id=8, x=2, normal=normal))
        readings = read_qif(written(tmp_path, full))
        assert isinstance(readings, FileReadings)
        assert readings.touches.labels == ("8",)
        assert readings.tip_radius == 2.5
        for old, new, words in (
            ("<Point>2 0 3", "<Point>2 0", "MeasurePoint 8: Point '2 0' is not 3"),
            ("<Compensated>false</Compensated>", "", "MeasurePoint 8: it does not say"),
            ("<Compensated>false", "<Compensated>true", "subtracted from point 8"),
            ("<ProbeRadius>", "<Transform>1</Transform><ProbeRadius>", "contains Transform"),
            ("MeasurePoint", "Gauge", "contains no measured points"),
            ("0 0 1", "0 0 2", "MeasurePoint 8: normal 1 has length 2"),
        ):
            with pytest.raises(InputError, match=words):
                read_qif(written(tmp_path, full.replace(old, new)))

    @pytest.mark.parametrize(
        ("units", "attribute", "others", "scale"),
        [
            ("<Units><LinearUnit><UnitName>inch</UnitName></LinearUnit></Units>", "", "", 25.4),
            (
                f"<Units><LinearUnit>{THOU}</LinearUnit></Units>",
                "", "", 0.0254,
            ),
            ("", ' linearUnit="thou"', "thou", 0.0254),
            ("", ' linearUnit="inch"', "", 25.4),
            ("<Units><AngularUnit><UnitName>deg</UnitName></AngularUnit></Units>", "", "", 1.0),
        ],
    )  # fmt: skip
    def test_units_of_a_set(
        self, tmp_path: Path, units: str, attribute: str, others: str, scale: float
    ) -> None:
        """A set can have units of its own, and units that the document declares with a factor."""
        declared = MM.replace("</FileUnits>", (
            f"<OtherUnits><LinearUnit><UnitName>{others}</UnitName><UnitConversion><Factor>"
            "0.0000254</Factor></UnitConversion></LinearUnit></OtherUnits></FileUnits>"
        ) if others else "</FileUnits>")  # fmt: skip
        text = QIF_FILE.replace("UNITS", declared).replace("<Points>", f"{units}<Points>")
        text = text.replace('count="2" id="7"', f'count="2" id="7"{attribute}')
        found = read_qif(written(tmp_path, text, "a.qif"))
        assert isinstance(found, FileReadings)
        assert found.touches.positions[0] == pytest.approx([0.0, 0.0, 3.0 * scale])

    def test_sets_of_two_tips_and_two_parts(self, tmp_path: Path) -> None:
        text = QIF_FILE.replace("UNITS", MM)
        one = text[text.index("<MeasurementResults id") : text.index("</MeasurementResultsSet>")]
        other = one.replace("2.5</ProbeRadius>", "1.5</ProbeRadius>").replace('id="7"', 'id="70"')
        both = text.replace(one, one + other)
        found = read_qif(written(tmp_path, both, "a.qif"))
        assert isinstance(found, FileReadings)
        assert found.touches.tips == ("R2.5", "R2.5", "R1.5", "R1.5")
        assert found.touches.parts == ("part 1", "part 1", "part 2", "part 2")

    @pytest.mark.parametrize(
        ("one", "other", "words"),
        [
            (
                "<SensorId>3</SensorId>",
                "<SensorId>4</SensorId>",
                ("sensor 3 R2.5", "sensor 4 R2.5"),
            ),
            ("<TipIds>3 4</TipIds>", "", ("tip 3 R2.5", "tip 4 R2.5")),
        ],
    )
    def test_sensors_and_tips_of_one_radius(
        self, tmp_path: Path, one: str, other: str, words: tuple[str, ...]
    ) -> None:
        text = QIF_FILE.replace("UNITS", MM).replace("</ProbeRadius>", f"</ProbeRadius>{one}")
        begin, end = text.index("<MeasuredPointSet "), text.index("</MeasuredPointSets>")
        more = text[begin:end].replace('id="7"', 'id="6"').replace(one, other)
        found = read_qif(written(tmp_path, text[:end] + more * bool(other) + text[end:]))
        assert isinstance(found, FileReadings)
        assert tuple(dict.fromkeys(found.touches.tips or ())) == words

    def test_what_is_not_read_is_named(self, tmp_path: Path) -> None:
        text = QIF_FILE.replace(
            "UNITS", f"<Header><Description>feed 300</Description></Header>{MM}"
        )
        text = text.replace(
            "<MeasuredPointSets", "<Temperature>27.5</Temperature><MeasuredPointSets"
        )
        text = text.replace(
            "</ProbeRadius>", "</ProbeRadius><Attributes/><!-- tip radius compensated -->"
        )
        found = read_qif(written(tmp_path, text.replace('"7"', '"7" validity="DUMMY"')))
        told = " ".join(found.warnings)
        for words in (
            "feed 300",
            "Temperature 27.5",
            "tip radius compensated",
            "Attributes, validity DUMMY",
        ):
            assert words in told

    def test_no_units_are_metres(self, tmp_path: Path) -> None:
        (found,) = read_point_sets(written(tmp_path, QIF_FILE.replace("UNITS", ""), "a.qif"))
        assert found.points[0].tolist() == [0, 0, 3000]
        assert found.radii is not None
        assert found.radii[0] == 2500.0

    @pytest.mark.parametrize(("name", "scale"), [("inch", 25.4), ("MM", 1.0), ("Metre", 1e3)])
    def test_a_unit_without_a_factor_has_the_length_of_its_name(
        self, tmp_path: Path, name: str, scale: float
    ) -> None:
        bare = re.sub("<UnitConversion>.*</UnitConversion>", "", MM).replace("mm", name)
        text = QIF_FILE.replace("UNITS", bare)
        (found,) = read_point_sets(written(tmp_path, text, "a.qif"))
        assert found.points[1] == pytest.approx([10.0 * scale, 0.0, 3.0 * scale], rel=1e-15)
        assert found.radii is not None
        assert found.radii[0] == pytest.approx(2.5 * scale, rel=1e-15)
        unknown = text.replace(f"<UnitName>{name}", "<UnitName>cubit")
        with pytest.raises(InputError, match="'cubit' is not known and has no factor"):
            read_point_sets(written(tmp_path, unknown, "b.qif"))

    def test_tip_centres_as_a_public_file_has_them(self, tmp_path: Path) -> None:
        """Figures of DMSC's sample: its reported deviation follows from centre and radius."""
        text = QIF_FILE.replace("UNITS", MM).replace('count="2"', 'count="1"')
        text = text.replace("0 0 3 10 0 3", "-51.726518705386 54.198959479609 -1.276811288879")
        text = text.replace("<Normals>0 0 1 0 0 1</Normals>", "").replace("2.5<", "2.49978271104<")
        (found,) = read_point_sets(written(tmp_path, text, "a.qif"))
        nominal = np.array([-50.175094015692, 54.198959479609, -3.125725044257])
        normal = np.array([-0.642788056925063, 0.0, 0.766044067841075])
        assert found.radii is not None
        deviation = float((found.points[0] - nominal) @ normal) - found.radii[0]
        assert deviation == pytest.approx(-0.086196035032941, abs=1e-9)
        rows_ = read_qif(tmp_path / "a.qif")
        assert isinstance(rows_, FilePositions)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("/qif3", "/qif1", "QIF 3 and 2 are read"),
            ('count="2"', 'count="3"', "its count asks for 9"),
            ("0 0 3 10", "0 0 NaN 10", "'NaN' is not a finite"),
            ("<Compensated>false", "<Compensated>true", "already subtracted"),
            ("<Compensated>false</Compensated>", "", "does not say whether"),
            ("<Normals>0 0 1", "<Normals>0 0 2", "normal 1 has length 2"),
            ("<Points>0 0 3 10 0 3</Points>", "<BinaryPoints/>", "binary forms are not"),
            (
                "<Points>",
                "<CoordinateSystemId>3</CoordinateSystemId><Points>",
                "its own coordinate",
            ),
            ("</Results>", "", "not well-formed XML"),
            ('<?xml version="1.0"?>', "<!DOCTYPE a []>", "entities"),
        ],
    )
    def test_refused(self, tmp_path: Path, old: str, new: str, words: str) -> None:
        text = QIF_FILE.replace("UNITS", MM).replace(old, new)
        with pytest.raises(InputError, match=words):
            read_qif(written(tmp_path, text, "a.qif"))

    def test_out_and_in_again_to_the_last_digit(self, tmp_path: Path) -> None:
        touches = example_touches()
        write_qif(tmp_path / "a.qif", touches.positions, touches.normals, touches.labels or (),
                  compensated=False, tip_radius=3.0)  # fmt: skip
        again = read_qif(tmp_path / "a.qif")
        assert isinstance(again, FileReadings)
        assert np.array_equal(again.touches.positions, touches.positions)
        assert again.touches.normals == pytest.approx(touches.normals, abs=4e-16)
        assert again.touches.labels == touches.labels

    def test_elements_stand_in_the_order_of_the_schema(self, tmp_path: Path) -> None:
        """Order and obligation as in the schema of QIF 3.0, transcribed for the path to the set."""
        touches = example_touches()
        write_qif(tmp_path / "a.qif", touches.positions, touches.normals, touches.labels or (),
                  compensated=True, tip_radius=3.0, deviations=np.zeros(len(touches)))  # fmt: skip
        schema = {
            "QIFDocument": (["QPId"], ["QPId", "Header", "FileUnits", "Features", "Results"]),
            "FileUnits": (["PrimaryUnits"], ["PrimaryUnits", "OtherUnits"]),
            "PrimaryUnits": ([], ["AreaUnit", "AngularUnit", "ForceUnit", "LinearUnit"]),
            "LinearUnit": (["UnitName"], ["SIUnitName", "UnitName", "UnitConversion"]),
            "UnitConversion": (["Factor"], ["Factor", "Offset"]),
            "Results": (["MeasurementResultsSet"], ["Version", "MeasurementResultsSet"]),
            "MeasurementResultsSet": (["MeasurementResults"], ["MeasurementResults"]),
            "MeasurementResults": (
                ["InspectionStatus"],
                ["Attributes", "MeasuredFeatures", "MeasuredPointSets", "InspectionStatus"],
            ),
            "MeasuredPointSets": (["MeasuredPointSet"], ["MeasuredPointSet"]),
            "MeasuredPointSet": (
                ["Points", "Compensated"],
                ["Attributes", "Units", "CoordinateSystemId", "Points", "Normals", "Compensated",
                 "ProbeRadii", "MeasurementDeviceId", "Deviations"],
            ),
            "InspectionStatus": (["InspectionStatusEnum"], ["InspectionStatusEnum"]),
        }  # fmt: skip
        root = ET.parse(tmp_path / "a.qif").getroot()
        ids = [element.get("id") for element in root.iter() if element.get("id")]
        assert len(set(ids)) == len(ids)
        assert int(root.get("idMax", "0")) >= max(int(str(name)) for name in ids)
        for element in root.iter():
            name = element.tag.rpartition("}")[2]
            children = [child.tag.rpartition("}")[2] for child in element]
            needed, order = schema.get(name, ([], []))
            assert set(needed) <= set(children), name
            assert children == sorted(children, key=order.index), name
        for tag in ("n", "count"):
            assert all(int(str(e.get(tag))) > 0 for e in root.iter() if e.get(tag) is not None)
