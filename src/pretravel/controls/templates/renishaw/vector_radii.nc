%
O{{ program }} (PRETRAVEL RADII)
(SETS #{{ base }}, #{{ base + 1 }} AND #{{ base + 10 }} TO #{{ last }}, THE RADII OF A VECTOR CALIBRATION. RUN IT ONCE)
{% for statement in statements %}
({{ statement|comment|upper }})
{% endfor %}
(#{{ base + 2 }} AND #{{ base + 3 }}, THE OFFSETS OF THE STYLUS, DO NOT CHANGE)
{% for variable, radius, name in radii %}
#{{ variable }}={{ radius }} ({{ name|comment|upper }})
{% endfor %}
M99
%
