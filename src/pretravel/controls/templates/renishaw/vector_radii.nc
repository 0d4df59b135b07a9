%
O{{ program }} (pretravel: vector radii, variables {{ base }} to {{ last }})
(from a map of kind {{ map.kind }}; radius less pretravel, mm)
(nearest-sector lookup leaves {{ "%.2f"|format(resampled.largest / micrometre) }} um at most, {{ "%.2f"|format(resampled.rms / micrometre) }} um rms, in the XY plane)
(touched at the sectors' angles it would leave {{ "%.2f"|format(touched.largest / micrometre) }} um at most, {{ "%.2f"|format(touched.rms / micrometre) }} um rms)
(stylus offsets, variables {{ base + 2 }} and {{ base + 3 }}, stay as they are)
{% for variable, radius, name in radii %}
#{{ variable }}={{ "%.5f"|format(radius) }} ({{ name }})
{% endfor %}
M99
%
