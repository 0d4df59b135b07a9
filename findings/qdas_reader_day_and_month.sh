#!/bin/sh
# aqdefreader 1.3.0 reads 03.11.2026 (day first in a Q-DAS file) as the 11th of March, and 28.11.2026 as the 28th of
# November: up to the 12th of a month, day and month change places, within one file.
# Expected: the third of November.
. "$(dirname "$0")/setup.sh"
packages aqdefreader==1.3.0 pandas==3.1.1 numpy==2.4.6 chardet==5.2.0 python-dateutil==2.9.0.post0
python <<'END'
import aqdefreader

head = ["K0100 1", "K1001 4711", "K2001/1 1", "K2002/1 diameter", "K2004/1 0"]
days = ["03.11.2026/12:00:00", "28.11.2026/12:00:00"]
file = aqdefreader.DfqFile(head + [f"20.001\x140\x14{day}" for day in days])
found = [m.datetime for m in file.get_part(0).get_characteristic_by_index(1).get_measurements()]
for day, date in zip(days, found):
    print(day, "->", date)
assert [(d.month, d.day) for d in found] == [(3, 11), (11, 28)], "the days are read otherwise now"
END
