#!/bin/sh
# dsiunits 3.1.3 (units of digital calibration certificates): a prefix in the denominator counts with the square of its exponent where units are brought
# to base units: 1 N/mm² is a million MPa, 1 g/cm³ is 10¹⁵ kg/m³. With the exponent −2 instead of "per" it is right.
# Expected: 1 MPa and 1000 kg/m³.
. "$(dirname "$0")/setup.sh"
packages dsiunits==3.1.3
python <<'END'
from dsi_unit import DsiUnit

def factor(unit, other):
    """How many of the other are one of the unit: the library returns how many of the unit are one of the other."""
    return 1 / DsiUnit(unit).get_scale_factor(DsiUnit(other))

def check(unit, other, right, seen):
    found = factor(unit, other)
    print(f"1 {unit} is {found:.6g} {other}, for {right:g}")
    assert abs(found / seen - 1) < 1e-9

check(r"\newton\per\metre\tothe{2}", r"\pascal", 1, 1)
check(r"\newton\milli\metre\tothe{-2}", r"\mega\pascal", 1, 1)
check(r"\newton\per\milli\metre\tothe{2}", r"\mega\pascal", 1, 1e6)
check(r"\gram\per\centi\metre\tothe{3}", r"\kilogram\per\metre\tothe{3}", 1e3, 1e15)
check(r"\micro\metre\per\metre\kelvin", r"\metre\per\metre\kelvin", 1e-6, 1e-6)
END
