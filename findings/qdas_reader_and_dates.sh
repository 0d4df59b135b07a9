#!/bin/sh
# aqdefreader 1.3.0 gives a value without a date the time of reading.
# Expected: no date. A shop that reads an old file again gets today's date in its course of values.
# The file has the form of `pretravel measure -o results.dfq` (tests/unit/files has the same bytes).
# The reader names none of its packages: pandas and chardet have to be installed beside it. With chardet
# 7.7.0, which finds no encoding in a file with separators of control, it raises an AttributeError.
. "$(dirname "$0")/setup.sh"
packages aqdefreader==1.3.0 pandas==3.1.1 numpy==2.4.6 chardet==5.2.0 python-dateutil==2.9.0.post0
python <<'END'
from datetime import datetime

import aqdefreader

text = (
    "K0100 2\r\nK1001 4711\r\n"
    "K2001/1 1\r\nK2002/1 bore1 diameter\r\nK2004/1 0\r\nK2022/1 5\r\n"
    "K2101/1 20.000000000\r\nK2110/1 20.000000000\r\nK2111/1 20.021000000\r\nK2142/1 mm\r\n"
    "K2001/2 2\r\nK2002/2 bore1 roundness\r\nK2004/2 0\r\nK2022/2 5\r\n"
    "K2111/2 0.004000000\r\nK2142/2 mm\r\n"
    "20.011200000\x140\x0f0.002100000\x140\r\n"
)
open("r.dfq", "w", newline="").write(text)
before = datetime.now()
part = aqdefreader.read_dfq_file("r.dfq").get_part(0)
found = [(c.get_data("K2002"), c.get_measurements()[0]) for c in part.get_characteristics()]
for name, measurement in found:
    print(name, measurement.value, measurement.attribute, measurement.datetime)
assert [(n, m.value, m.attribute) for n, m in found] == [
    ("bore1 diameter", 20.0112, 0),
    ("bore1 roundness", 0.0021, 0),
], "the values are read otherwise now"
assert all(before <= m.datetime <= datetime.now() for _, m in found), "the date is another now"
END
