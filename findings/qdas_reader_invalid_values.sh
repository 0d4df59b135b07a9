#!/bin/sh
# aqdefreader 1.3.0 drops a value with the attribute 255 (not valid) from a line of values, and keeps the same value
# where it is coded (K0001, K0002 255). Its table of columns shifts the values after a dropped one up by a row: the
# second diameter stands beside the first roundness.
# Expected: the same in both forms, and rows that belong to one part.
. "$(dirname "$0")/setup.sh"
packages aqdefreader==1.3.0 pandas==3.1.1 numpy==2.4.6 chardet==5.2.0 python-dateutil==2.9.0.post0
python <<'END'
import aqdefreader

head = ["K0100 2", "K1001 4711", "K2001/1 1", "K2002/1 diameter", "K2004/1 0",
        "K2001/2 2", "K2002/2 roundness", "K2004/2 0"]
lines = ["20.001\x14255\x0f0.001\x140", "20.002\x140\x0f0.002\x140"]
coded = ["K0001/1 20,001", "K0002/1 255", "K0001/2 0,001", "K0001/1 20,002", "K0001/2 0,002"]


def diameters(file):
    return [m.value for m in file.get_part(0).get_characteristic_by_index(1).get_measurements()]


in_lines, in_code = aqdefreader.DfqFile(head + lines), aqdefreader.DfqFile(head + coded)
print("line of values:", diameters(in_lines), "coded:", diameters(in_code))
assert (diameters(in_lines), diameters(in_code)) == ([20.002], [20.001, 20.002])
table = aqdefreader.create_column_dataframe(in_lines, group_by_date=False)
print(table)
assert float(table.iloc[0, 0]) == 20.002 and float(table.iloc[0, 1]) == 0.001, "not shifted now"
END
