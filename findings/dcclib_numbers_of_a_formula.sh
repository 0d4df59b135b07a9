#!/bin/sh
# dcclib 0.4.0 (formulas of digital calibration certificates, in MathML): of a number with two parts the first is read. α = 11.5e-6 as
# <cn type="e-notation">11.5<sep/>-6</cn> is 11.5: 100 mm grow by 2.3 m at 2 K; a third, <cn type="rational">1<sep/>3</cn>, is 1; 10 to the base 16 is 10.
# <log/> without a base is the natural logarithm; MathML has 10. The same value as type="real" is right.
# Expected: 2.3 µm, 1/3, 16, log10.
. "$(dirname "$0")/setup.sh"
packages lxml==6.1.3 sympy==1.14.0 mpmath==1.3.0 xmlschema==4.3.2 requests==2.34.2 platformdirs==4.14.8 saxonche==13.1.1
PIP_NO_DEPS=1 packages dcclib==0.4.0 dcc-json-toolkit==1.2.5
python <<'END'
import math

from dcclib.extraction.formulae import FormulaExtractor

def value(term, **variables):
    """A function of the certificate, evaluated."""
    bound = "".join(f"<bvar><ci>{name}</ci></bvar>" for name in variables)
    function = f'<declare type="fn"><ci>f</ci><lambda>{bound}<apply>{term}</apply></lambda></declare>'
    math_part = f'<math xmlns="http://www.w3.org/1998/Math/MathML">{function}</math>'
    document = f'<dcc:formula xmlns:dcc="https://ptb.de/dcc"><dcc:mathml>{math_part}</dcc:mathml></dcc:formula>'
    (read,) = FormulaExtractor.from_str(document).extract()
    return float(read.evaluate(variables)[0].output)

def growth(number):
    return value(f"<times/>{number}<ci>L</ci><ci>t</ci>", L=100.0, t=2.0)

found = {
    "growth in mm, e-notation": (growth('<cn type="e-notation">11.5<sep/>-6</cn>'), 0.0023, 2300),
    "growth in mm, real": (growth('<cn type="real">11.5e-6</cn>'), 0.0023, 0.0023),
    "a third": (value('<times/><cn type="rational">1<sep/>3</cn><ci>x</ci>', x=1.0), 1 / 3, 1),
    "10 to the base 16": (value('<times/><cn type="integer" base="16">10</cn><ci>x</ci>', x=1.0), 16, 10),
    "log 100": (value("<log/><ci>x</ci>", x=100.0), 2, math.log(100)),
}
for name, (seen, right, _) in found.items():
    print(f"{name}: {seen:.6g}, right is {right:.6g}")
assert all(math.isclose(seen, known) for seen, _, known in found.values())
END
