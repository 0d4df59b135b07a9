#!/bin/sh
# rmellipse 0.5.0 (NIST, propagation as in the GUM): combine(…, error_of_mean=True) of readings that hold one value in an array, as an array of
# diameters with one feature does, gives s, as without the option. With two values in the array, or without an array, it gives s/√n.
# Expected: s/√n for each of them.
. "$(dirname "$0")/setup.sh"
packages rmellipse==0.5.0 xarray==2026.9.0 numpy==2.4.6 scipy==1.17.1 h5py==3.16.0 pyyaml==6.0.4
python <<'END'
import warnings

warnings.simplefilter("ignore")
import numpy as np
import xarray as xr
from rmellipse.propagators import RMEProp
from rmellipse.uobjects import RMEMeas

readings = np.array([10.001, 10.003, 9.999, 10.002, 10.000])
s = readings.std(ddof=1)
propagator = RMEProp(sensitivity=True)

def combined(shape, error_of_mean):
    dims = [f"axis{i}" for i in range(len(shape))]
    coords = {dim: np.arange(size) for dim, size in zip(dims, shape)}
    measured = [
        RMEMeas.from_nom("diameter", xr.DataArray(np.full(shape, x), dims=dims, coords=coords)) for x in readings
    ]
    mean = propagator.combine(*measured, error_of_mean=error_of_mean)
    assert np.allclose(mean.dof(), 4)
    return float(np.ravel(mean.stdunc().cov)[0])

seen = {shape: (combined(shape, False) / s, combined(shape, True) / s) for shape in ((), (1,), (1, 1), (2,))}
print(f"s = {s * 1e3:.4f} µm, s/√5 = {s / 5**0.5 * 1e3:.4f} µm; u over s without and with error_of_mean, by shape:")
print({shape: tuple(round(float(u), 4) for u in both) for shape, both in seen.items()})
for shape, (of_one, of_mean) in seen.items():
    assert abs(of_one - 1) < 1e-9
    assert abs(of_mean - (1 if shape in ((1,), (1, 1)) else 5**-0.5)) < 1e-9
END
