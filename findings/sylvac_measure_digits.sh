#!/bin/sh
# sylvac-measure 0.3.0 (dial indicators and calipers by Bluetooth) writes the value of an instrument in inches with a digit less than its
# resolution needs: of 1 µm steps remain 2.5 µm. An instrument in degrees and minutes is written in decimal degrees with the sign of minutes:
# 12.5° is "12.50 °'", which reads as 12° 50'.
# Expected: steps of the instrument; 12°30'.
. "$(dirname "$0")/setup.sh"
packages sylvac-measure==0.3.0
python <<'END'
from sylvac import _protocol as protocol

def shown(si, unit, step):
    value = protocol.si_to_display(si, unit)
    resolution = protocol.resolution_in_display_unit(step, unit)
    return f"{protocol.Measurement(value, unit, resolution, protocol.MeasuringMode.NORMAL).format()} {unit}"

micrometres = range(20_000, 20_026)
inches = [shown(z * 1e-6, protocol.Unit.INCH, 1e-6) for z in micrometres]
millimetres = [shown(z * 1e-6, protocol.Unit.MM, 1e-6) for z in micrometres]
angle = shown(12.5 * 3.141592653589793 / 180, protocol.Unit.DEG_MIN, 1e-4)
print(len(set(millimetres)), "values in mm,", len(set(inches)), "in inches:", inches[:4], "12.5°:", angle)
assert (len(set(millimetres)), len(set(inches)), angle) == (26, 11, "12.50 °'")
END
