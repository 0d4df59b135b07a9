#!/bin/sh
# cmm-measurement-parser 1.1.0 (reports of CALYPSO in Japanese), 20 +0.021/0: `tolerance_utilization` is the deviation divided by half the tolerance, so
# 20.015 has 142.86 % and is a PASS, and 19.999 has 9.52 % and is a FAIL; ±0.05 is right. A line whose name is neither a number nor X-値_…, Y-値_…,
# Z-値_… is left out without a word: with the diameter 直径_円1 of 20.030 the pass rate of the circle is still 100 %.
# Expected: 142.86 % for no part that passes; from the middle 20.0105, 42.86 % and 109.5 %. Every line of the report, or an error.
. "$(dirname "$0")/setup.sh"
packages cmm-measurement-parser==1.1.0 numpy==2.4.6 pandas==3.0.0 openpyxl==3.1.5
python <<'END'
import contextlib
import io

import cmm_measurement_parser

ELEMENT = "円1 円(最小二乗法) 点数 (8) 内側"
PLACE = "X-値_円1 X 10.0100 10.0000 0.0500 -0.0500 0.0100"


def read(*lines):
    with contextlib.redirect_stdout(io.StringIO()):
        return cmm_measurement_parser.process_cmm_data([ELEMENT, *lines], use_japanese_columns=False)


table, _ = read("1 D 20.0150 20.0000 0.0210 0.0000 0.0150", "2 D 19.9990 20.0000 0.0210 0.0000 -0.0010", PLACE)
seen = list(zip(table["measured_value"], table["tolerance_utilization"], table["status"]))
print(seen)
assert seen == [(20.015, 142.86, "PASS"), (19.999, 9.52, "FAIL"), (10.01, 20.0, "PASS")]

table, summary = read(PLACE, "直径_円1 D 20.0300 20.0000 0.0210 0.0000 0.0300")
print("read", len(table), "of 2 lines, pass rate", summary["pass_rate"][0])
assert list(table["coordinate_name"]) == ["X-値_円1"] and summary["pass_rate"][0] == 100
END
