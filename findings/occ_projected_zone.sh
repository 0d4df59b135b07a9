#!/bin/sh
# Open CASCADE 8.0.1 drops a projected tolerance zone of 12 mm on the way through AP242, without a word: a parallelism
# comes back with its value and its maximum material condition, and without zone and length. Its largest tolerance of 0.2 is
# in the file, and is not read.
# Expected: PROJECTED_ZONE_DEFINITION in the file, and 12 mm at the end.
. "$(dirname "$0")/setup.sh"
packages cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
from OCP import XCAFDimTolObjects as names
from occ_pmi import Tolerance, dimension, round_trip

wanted = Tolerance()
wanted.SetType(names.XCAFDimTolObjects_GeomToleranceType.XCAFDimTolObjects_GeomToleranceType_Parallelism)
wanted.SetValue(0.05)
zone = names.XCAFDimTolObjects_GeomToleranceZoneModif
wanted.SetZoneModifier(zone.XCAFDimTolObjects_GeomToleranceZoneModif_Projected)
wanted.SetValueOfZoneModifier(12.0)
material = names.XCAFDimTolObjects_GeomToleranceMatReqModif.XCAFDimTolObjects_GeomToleranceMatReqModif_M
wanted.SetMaterialRequirementModifier(material)
wanted.SetMaxValueModifier(0.2)
size = dimension("LinearDistance", 30.0, upper=0.1, lower=0.0)
_, tolerances, _, text = round_trip("box.stp", [size], [wanted])
found = tolerances[0]
print("SEEN", found.GetValue(), found.GetZoneModifier().name, found.GetValueOfZoneModifier(),
      found.GetMaxValueModifier(), "PROJECTED" in text, "MAXIMUM_TOLERANCE" in text)
assert (found.GetValue(), found.GetMaterialRequirementModifier()) == (0.05, material)
assert found.GetZoneModifier() == zone.XCAFDimTolObjects_GeomToleranceZoneModif_None
assert found.GetMaxValueModifier() == 0.0
assert "PROJECTED" not in text and "MAXIMUM_TOLERANCE" in text
END
grep SEEN "$folder/out"
