"""PMI as text, to append to the bracket (examples/data/bracket.step); the text is ours.

The bracket is in mm; its faces by number: 1 and 6 planes 80 mm apart, 5 the bottom, 3 the top, 12
and 14 bores of 12 and 8 mm, 13 a boss of 14 mm.
"""

from pretravel.drawing.pmi.model import ModelDrawing

FACE = {1: 17, 2: 137, 3: 265, 5: 676, 6: 755, 7: 780, 12: 939, 13: 966, 14: 1021, 9: 814, 11: 912}
"""Instances of the faces by number."""
UNITS = """\
#2001=(CONVERSION_BASED_UNIT('INCH',#2002)LENGTH_UNIT()NAMED_UNIT(#2003));
#2002=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#1060);
#2003=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#2004=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
"""
DATUMS = """\
#2100=DATUM('',$,#4,.F.,'A'); #2101=DATUM_FEATURE('',$,#4,.T.);
#2102=SHAPE_ASPECT_RELATIONSHIP('',$,#2101,#2100);
#2110=(DATUM('B')SHAPE_ASPECT('',$,#4,.F.)); #2111=DATUM_FEATURE('',$,#4,.T.);
#2112=SHAPE_ASPECT_RELATIONSHIP('',$,#2111,#2110);
#2120=DATUM('',$,#4,.F.,'D'); #2121=DATUM_FEATURE('',$,#4,.T.);
#2122=SHAPE_ASPECT_RELATIONSHIP('',$,#2121,#2120);
"""
IN_FRAMES = """\
#2130=DATUM_REFERENCE_COMPARTMENT('',$,#4,.F.,#2100,$);
#2131=DATUM_REFERENCE_COMPARTMENT('',$,#4,.F.,#2110,$);
#2132=DATUM_REFERENCE_COMPARTMENT('',$,#4,.F.,#2120,
  (SIMPLE_DATUM_REFERENCE_MODIFIER(.MAXIMUM_MATERIAL_REQUIREMENT.)));
#2135=DATUM_SYSTEM('',$,#4,.F.,(#2130)); #2136=DATUM_SYSTEM('',$,#4,.F.,(#2130,#2132,#2131));
#2137=DATUM_REFERENCE_ELEMENT('',$,#4,.F.,#2120,$);
#2138=DATUM_REFERENCE_ELEMENT('',$,#4,.F.,#2110,$);
#2139=DATUM_REFERENCE_COMPARTMENT('',$,#4,.F.,COMMON_DATUM_LIST((#2137,#2138)),$);
#2140=DATUM_SYSTEM('',$,#4,.F.,(#2139));
"""


def bound(number: int, aspect: int, *faces: int) -> str:
    """Lines that bind a shape aspect to faces."""
    return "".join(
        f"#{number + k}=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#{aspect},#10,#{FACE[face]});\n"
        for k, face in enumerate(faces)
    )


def length(number: int, value: float, unit: int = 1060, name: str | None = None) -> str:
    """A line with a length, as a complex instance where it has a name."""
    if name is None:
        return f"#{number}=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({value}),#{unit});\n"
    return (
        f"#{number}=(LENGTH_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()"
        f"MEASURE_WITH_UNIT(LENGTH_MEASURE({value}),#{unit})REPRESENTATION_ITEM('{name}'));\n"
    )


def size(number: int, face: int, nominal: float, unit: int = 1060) -> str:
    """A diameter of a face with its nominal value, without limits."""
    return (
        f"#{number}=SHAPE_ASPECT('','',#4,.T.);\n"
        f"#{number + 1}=DIMENSIONAL_SIZE(#{number},'diameter');\n"
        + bound(number + 2, number, face)
        + length(number + 3, nominal, unit, "nominal value")
        + f"#{number + 4}=SHAPE_DIMENSION_REPRESENTATION('',(#{number + 3}),#1059);\n"
        f"#{number + 5}=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#{number + 1},#{number + 4});\n"
    )


def plus_minus(number: int, dimension: int, low: float, high: float, unit: int = 1060) -> str:
    return (
        length(number, low, unit)
        + length(number + 1, high, unit)
        + f"#{number + 2}=TOLERANCE_VALUE(#{number},#{number + 1});\n"
        f"#{number + 3}=PLUS_MINUS_TOLERANCE(#{number + 2},#{dimension});\n"
    )


ALL_DATUMS = (
    UNITS + DATUMS + bound(2103, 2101, 5) + bound(2113, 2111, 1) + bound(2123, 2121, 12) + IN_FRAMES
)


def numbers(found: ModelDrawing, faces: tuple[int, ...]) -> list[int]:
    return [found.numbers[face] for face in faces]
