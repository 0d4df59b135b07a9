#!/bin/sh
# pint 0.25.3 with uncertainties 3.2.3: the difference of two temperatures is a difference (delta_degC) without uncertainties, and a
# temperature with them: 25 ± 0.1 °C less 20 ± 0.1 °C is 278.15 K. The uncertainty of a temperature, error, is one, too: 0.1 °C is 273.25 K;
# its part in the length of 100 mm of steel is 314 µm for 0.115 µm where offsets are converted (autoconvert_offset_to_baseunit), else an error.
# Expected: 5 K and 0.1 K, with uncertainties as without.
. "$(dirname "$0")/setup.sh"
packages pint==0.25.3 uncertainties==3.2.3 numpy==2.4.6
python <<'END'
import pint

units = pint.UnitRegistry()
plain = units.Quantity(25.0, "degC") - units.Quantity(20.0, "degC")
part, gauge = units.Measurement(25.0, 0.1, "degC"), units.Measurement(20.0, 0.1, "degC")
stated = part - gauge
print("without:", plain, "=", plain.to("K"), "with:", stated, "=", stated.to("K"), "error:", part.error.to("K"))
assert abs(plain.to("K").magnitude - 5.0) < 1e-9
assert abs(stated.to("K").value.magnitude - 278.15) < 1e-9, "a difference is one now"
assert abs(part.error.to("K").magnitude - 273.25) < 1e-9, "an error is a difference now"
assert abs(part.to("K").error.magnitude - 0.1) < 1e-9

units = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
part = units.Measurement(25.0, 0.1, "degC")
expansion = units.Quantity(11.5e-6, "1/K") * units.Quantity(100.0, "mm")
print("its part in a length:", (expansion * part.error).to("um"), "; first to K:", (expansion * part.to("K").error).to("um"))
assert abs((expansion * part.error).to("um").magnitude - 314.2375) < 1e-6
assert abs((expansion * part.to("K").error).to("um").magnitude - 0.115) < 1e-9
END
