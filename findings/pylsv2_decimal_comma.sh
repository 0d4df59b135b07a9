#!/bin/sh
# pyLSV2 1.8.0 (tool and preset tables of Heidenhain controls): dump_csv(decimal_char=",") writes the commas into the table itself. The table that
# dump_native writes afterwards has "+150,253" where the control's own file has a point, and format_entry_float of a cell raises.
# Expected: a CSV file is a copy; the table for the control keeps its points.
. "$(dirname "$0")/setup.sh"
packages pyLSV2==1.8.0
python <<'END'
from pathlib import Path

from pyLSV2.table_reader import NCTable

original = """BEGIN TOOL.T MM
T    NAME             L           R
0    NULL             +0          +0
1    PROBE            +150.253    +2.9987
[END]
"""
Path("TOOL.T").write_text(original)
table = NCTable.parse_table(Path("TOOL.T"))

def native(name):
    table.dump_native(Path(name))
    return Path(name).read_text().splitlines()[3]

before = native("before.T")
table.dump_csv(Path("points.csv"))
with_points = native("points.T")
table.dump_csv(Path("office.csv"), decimal_char=",")
after = native("after.T")
print("before:", before, " after a CSV file with points:", with_points, " with commas:", after)
assert before == with_points == original.splitlines()[3]
assert after.split() == ["1", "PROBE", "+150,253", "+2,9987"]
try:
    NCTable.format_entry_float(table.rows[1]["L"])
except ValueError as error:
    print(error)
else:
    raise SystemExit("the length is a number now")
END
