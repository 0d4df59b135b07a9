%
O{{ program }} (pretravel: vector radii, variables {{ base }} to {{ last }})
(from a map of kind {{ map.kind }}; radius minus pretravel, mm)
(with the nearest sector a residual of {{ "%.2f"|format(resampled.largest / micrometre) }} um at most, {{ "%.2f"|format(resampled.rms / micrometre) }} um rms remains in the XY plane)
(radii from touches at the sectors' angles would leave {{ "%.2f"|format(touched.largest / micrometre) }} um at most, {{ "%.2f"|format(touched.rms / micrometre) }} um rms)
(stylus offsets, variables {{ base + 2 }} and {{ base + 3 }}, do not change)
{% for variable, radius, name in radii %}
#{{ variable }}={{ "%.5f"|format(radius) }} ({{ name }})
{% endfor %}
M99
%
