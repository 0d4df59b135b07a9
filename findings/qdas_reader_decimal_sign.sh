#!/bin/sh
# aqdefreader 1.3.0 knows a decimal comma in a coded value (K0001) and a decimal point in a line of values, each
# alone: K0001/1 9.999 stays text, as does every negative number; 9,999 in a line of values is an error.
# Expected: numbers, since ISO/TR 11462-5 files have both forms and both signs.
. "$(dirname "$0")/setup.sh"
packages aqdefreader==1.3.0 pandas==3.1.1 numpy==2.4.6 chardet==5.2.0 python-dateutil==2.9.0.post0
python <<'END'
import aqdefreader

head = ["K0100 1", "K1001 4711", "K2001/1 1", "K2002/1 diameter", "K2004/1 0"]
coded = ["9.999", "9,999", "-0.012", "-0,012", "10"]
part = aqdefreader.DfqFile(head + [f"K0001/1 {text}" for text in coded]).get_part(0)
values = [m.value for m in part.get_characteristic_by_index(1).get_measurements()]
print("coded:", dict(zip(coded, values)))
assert values == ["9.999", 9.999, "-0.012", "-0,012", 10], values
part = aqdefreader.DfqFile([*head, "-0.012\x140"]).get_part(0)
assert part.get_characteristic_by_index(1).get_measurements()[0].value == -0.012
try:
    aqdefreader.DfqFile([*head, "9,999\x140"])
except ValueError as error:
    print("in a line of values:", error)
else:
    raise SystemExit("9,999 in a line of values is read now")
END
