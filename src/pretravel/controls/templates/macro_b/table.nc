%
O{{ first }} (PRETRAVEL TABLE)
{% include "macro_b/head.nc" %}
(FILLS #{{ base }} TO #{{ base + table.values|length }}. RUN IT ONCE, AND AGAIN AFTER ANY CHANGE)
{% for value in table.values %}
#{{ base + loop.index }}={{ value }}
{% endfor %}
(THE NUMBER OF THE TABLE, WHICH O{{ second }} COMPARES)
#{{ base }}={{ table.number }}
M99
%
