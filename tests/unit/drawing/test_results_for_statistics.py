"""Measured features as Q-DAS (.dfq) and QIF 3 (.qif) results.

The Q-DAS file here is the one that an independent reader reads in
``findings/qdas_reader_and_dates.sh``. Documents as those here were validated against the public
schema of QIF 3.0 (which is not ours to copy); its rules that a file can break are repeated here.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from pretravel.base.errors import PretravelError
from pretravel.drawing.features.qdas_results import write_qdas_results
from pretravel.drawing.features.qif_results import write_qif_results
from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES

QIF = "{http://qifstandards.org/xsd/qif3}"


def _row(feature: str, quantity: str, value: float, **others: Any) -> dict[str, Any]:
    base = {"unit": "mm", "u": 0.0005, "lower": None, "upper": None, "verdict": None}
    return (
        {"feature": feature, "kind": "bore", "quantity": quantity, "value": value} | base | others
    )


ROWS = [
    _row("bore1", "diameter", 20.0112, lower=20.0, upper=20.021, verdict="conforms"),
    _row("bore1", "roundness", 0.0021, upper=0.004, verdict="cannot be decided"),
    _row("bore1", "x", -0.0123, u=None),
    _row("cone", "angle", 45.5, unit="deg", lower=45.0, verdict="does not conform"),
]


def test_a_q_das_file(tmp_path: Path) -> None:
    path = tmp_path / "r.dfq"
    write_qdas_results(path, ROWS[:2], part="4711", nominals={("bore1", "diameter"): 20.0})
    assert path.read_bytes() == (
        b"K0100 2\r\nK1001 4711\r\n"
        b"K2001/1 1\r\nK2002/1 bore1 diameter\r\nK2004/1 0\r\nK2022/1 5\r\n"
        b"K2101/1 20.000000000\r\nK2110/1 20.000000000\r\nK2111/1 20.021000000\r\nK2142/1 mm\r\n"
        b"K2001/2 2\r\nK2002/2 bore1 roundness\r\nK2004/2 0\r\nK2022/2 5\r\n"
        b"K2111/2 0.004000000\r\nK2142/2 mm\r\n"
        b"20.011200000\x140\x0f0.002100000\x140\r\n"
    )


@pytest.mark.parametrize("name", ["孔1", "a\x14b"])
def test_a_name_that_q_das_cannot_carry_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(PretravelError, match="cannot carry"):
        write_qdas_results(tmp_path / "r.dfq", [_row(name, "x", 1.0)], part="4711")
    assert not list(tmp_path.iterdir())


def _document(path: Path) -> ET.Element:
    write_qif_results(path, ROWS, part="4711", nominals={("bore1", "diameter"): 20.0})
    return ET.parse(path).getroot()  # it was written here


def test_the_ids_of_a_qif_document(tmp_path: Path) -> None:
    """Each once, none above idMax; what refers to one finds it (keys of the schema)."""
    root = _document(tmp_path / "r.qif")
    ids = [int(each.get("id", "0")) for each in root.iter() if each.get("id")]
    assert len(set(ids)) == len(ids)
    assert max(ids) == int(root.get("idMax", "0"))
    references = [
        each for each in root.iter() if each.tag.endswith("Id") and each.tag != QIF + "QPId"
    ]
    assert {int(each.text or "") for each in references} <= set(ids)
    for part in root.iter():
        if part.get("n") is not None:
            assert len(part) == int(part.get("n", "0"))


def test_a_qif_value_has_its_uncertainty_and_its_verdict(tmp_path: Path) -> None:
    root = _document(tmp_path / "r.qif")
    measured = root.find(f".//{QIF}CharacteristicMeasurements")
    assert measured is not None
    found = [
        (
            each.tag.removeprefix(QIF).removesuffix("CharacteristicMeasurement"),
            each.findtext(f"{QIF}Status/*"),
            float(each.findtext(f"{QIF}Value") or ""),
            next(each.iter(f"{QIF}Value")).attrib,
        )
        for each in measured
    ]
    u = {"combinedUncertainty": "0.000500000", "meanError": "0"}  # both or none: the schema's note
    assert found == [
        ("Diameter", "PASS", 20.0112, u),
        ("Circularity", "INDETERMINATE", 0.0021, u),
        ("UserDefinedLinear", "NOT_ANALYZED", -0.0123, {}),
        ("UserDefinedAngular", "FAIL", 45.5, u),
    ]
    assert root.findtext(f".//{QIF}InspectionStatusEnum") == "FAIL"
    limits = [e.text for e in root.iterfind(f".//{QIF}Tolerance/*")]
    assert limits == ["20.021000000", "20.000000000", "true", "45.000000000", "true"]
    assert root.findtext(f".//{QIF}TargetValue") == "20.000000000"


def test_a_verdict_without_the_machine_stays_words(tmp_path: Path) -> None:
    words = "within the tolerance, machine not in u"
    write_qif_results(tmp_path / "r.qif", [_row("b", "diameter", 20.0, verdict=words)], part="p")
    root = ET.parse(tmp_path / "r.qif").getroot()
    assert root.findtext(f".//{QIF}OtherCharacteristicStatus") == words
    assert root.findtext(f".//{QIF}InspectionStatusEnum") == "UNKNOWN"


def test_results_are_read_as_a_table(tmp_path: Path) -> None:
    """As written; and in inches, if the unit of the document has 25.4 mm."""
    path, out = tmp_path / "r.qif", tmp_path / "f.csv"
    write_qif_results(path, ROWS, part="4711", nominals={("bore1", "diameter"): 20.0})
    for scale in (1.0, 25.4):
        text = path.read_text().replace(">0.001000000000000000<", f">{0.001 * scale:.7f}<")
        (tmp_path / "a.qif").write_text(text)
        run("convert", tmp_path / "a.qif", "--features", "-o", out)
        table = rows(out)
        assert [row["quantity"] for row in table] == [
            "diameter", "circularity", "user defined linear", "user defined angular"
        ]  # fmt: skip
        assert table[0]["feature"] == "bore1 diameter"
        assert float(table[0]["actual"]) == pytest.approx(scale * 20.0112)
        assert float(table[0]["nominal"]) == pytest.approx(scale * 20.0)
        assert float(table[3]["actual"]) == pytest.approx(45.5)
    told = run("convert", path, "-o", tmp_path / "t.csv", code=2)
    assert "characteristics can be written" in told


@pytest.mark.long
def test_measure_writes_both(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(
        *("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987),
        *("--tip-diameter", 6, "--kind", "harmonic", "-o", "map.json"),
    )
    run("compensate", EXAMPLES / "bore_touches.csv", "--map", "map.json", "-o", "points.csv")
    wanted: tuple[object, ...] = (
        "measure",
        "points.csv",
        "--feature",
        "bore",
        "--select",
        "bore*",
        "--group",
    )
    wanted += ("--nominal", 20, "--tolerance", "+0.03/-0.03", "--u-machine", 0.5, "-o")
    for name in ("r.csv", "r.dfq", "r.qif"):
        run(*wanted, name)
    expected = [float(row["value"]) for row in rows(Path("r.csv"))]
    line = Path("r.dfq").read_text(encoding="cp1252").splitlines()[-1]
    assert [float(v.split("\x14")[0]) for v in line.split("\x0f")] == pytest.approx(expected)
    root = ET.parse("r.qif").getroot()
    values = [float(each.text or "") for each in root.iter(f"{QIF}Value")]
    assert values == pytest.approx(expected)


def test_the_limits_of_an_angle_are_degrees(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As its value is; they were rad (pi / 2 for 90 degrees)."""
    monkeypatch.chdir(tmp_path)
    grid = [(u, v, 1e-4 * (-1) ** (u + v)) for u in range(4) for v in range(4)]
    lines = ["label,x_mm,y_mm,z_mm,nx,ny,nz,u_um"]
    lines += [f"a-{i},{u},{v},{w},0,0,1,0.5" for i, (u, v, w) in enumerate(grid)]
    lines += [f"b-{i},{w},{v},{u},1,0,0,0.5" for i, (u, v, w) in enumerate(grid)]
    Path("points.csv").write_text("\n".join(lines))
    Path("drawing.toml").write_text(
        '[[feature]]\nkind = "plane"\nselect = "a*"\nlabel = "a"\n'
        '[[feature]]\nkind = "plane"\nselect = "b*"\nlabel = "b"\n'
        '[[between]]\nfeatures = ["a", "b"]\nquantity = "angle"\nnominal = 90\n'
        'tolerance = "±0.5"\n'
    )
    run("measure", "points.csv", "--drawing", "drawing.toml", "-o", "r.csv")
    angle = next(row for row in rows(Path("r.csv")) if row["quantity"] == "angle")
    assert [float(angle[key]) for key in ("lower", "upper")] == pytest.approx([89.5, 90.5])
    assert angle["unit"] == "deg"
