#!/bin/sh
# dccQuantities 2.2.0 (digital calibration certificates; 3.0.4 has the same lines): an uncertainty stated as uniform with k = 1.73 is taken as ±1 of the
# unit: 0.58 mm for 1 µm/1.73; with 1.732 it is right. Three values with k = 2, 2.52 and 4.53 for one stated coverage of 0.95 all get k = 2: 0.5 µm for
# 0.5, 0.40 and 0.22 µm.
# Expected: U/k for each value. Needs Debian's packages mono-runtime and mono-devel. Newer packages fetch the schema when they are imported.
. "$(dirname "$0")/setup.sh"
command -v mono >/dev/null || { echo "needs mono: apt-get install mono-devel" >&2; exit 2; }
packages dsiUnits==3.1.3 metas-unclib==3.0.3 pythonnet==3.2.1 numpy==2.4.6 xmlschema==4.3.2 lxml==6.1.3 Jinja2==3.1.6 importlib_resources==7.1.0
PIP_NO_DEPS=1 packages dccQuantities==2.2.0.post1 dccXMLJSONConv==3.0.0.dev7
PYTHONNET_RUNTIME=mono python 2>"$folder/warnings" <<'END' || { cat "$folder/warnings" >&2; exit 1; }
from importlib.resources import files

import numpy as np
import xmlschema
from dcc_quantities import SiRealList

SCHEMA = xmlschema.XMLSchema(str(files("dccXMLJSONConv.schemata") / "https/ptb.de/si/v2.2.1/SI_Format.xsd"))

def read(tag, **values):
    """Standard uncertainties of a quantity in mm, written as D-SI has it, with its list suffix; the schema of PTB checks it."""
    end = "XMLList" if tag.endswith("XMLList") else ""
    def element(name, text):
        return f"<si:{name}{end}>{text}</si:{name}{end}>"
    names = ("valueExpandedMU", "coverageFactor", "coverageProbability", "distribution")
    inner = "".join(element(name, values[name]) for name in names)
    unit = element("unit", r"\milli\metre")
    stated = element("measurementUncertaintyUnivariate", element("expandedMU", inner))
    document = f'<si:{tag} xmlns:si="https://ptb.de/si">{element("value", values["value"])}{unit}{stated}</si:{tag}>'
    SCHEMA.validate(document)
    return SiRealList.from_dcc_data({f"si:{tag}": SCHEMA.to_dict(document)}).uncertainties

def uniform(factor):
    return read("real", value=25.0, valueExpandedMU=0.001, coverageFactor=factor, coverageProbability=1.0, distribution="uniform")[0]

three = read(
    "realListXMLList", value="10 20 30", valueExpandedMU=0.001, coverageFactor="2.0 2.52 4.53", coverageProbability=0.95, distribution="normal"
)
print("uniform, U = 1 µm, u in mm:", {factor: float(uniform(factor)) for factor in (1.73, 1.732)}, "k = 2, 2.52, 4.53:", three)
assert abs(uniform(1.732) - 0.001 / 1.732) < 1e-12
assert abs(uniform(1.73) - 1 / np.sqrt(3)) < 1e-9
assert np.allclose(three, 0.0005, rtol=1e-12)
END
