%
O{{ program }} (FILLS #{{ base }} TO #{{ base + form.values.size - 1 }})
{% include "fanuc/head.nc" %}
{% for value in form.values.flat %}
#{{ base + loop.index0 }}={{ "%.7f"|format(value + travel) }}
{% endfor %}
M99
O{{ program + 1 }} (G65 P{{ program + 1 }} I J K: PRETRAVEL ALONG THE NORMAL TO #100)
{% include "fanuc/head.nc" %}
#11=#4
#12=#5
#13=#6
{% for axis in range(3) %}
{% set probe_axis = map.rotation.T[axis] %}
#{{ 7 + axis }}=[{{ "%.9f"|format(probe_axis[0]) }}]*#11+[{{ "%.9f"|format(probe_axis[1]) }}]*#12+[{{ "%.9f"|format(probe_axis[2]) }}]*#13
{% endfor %}
#14=SQRT[#7*#7+#8*#8]
#15=0
IF[#14GT0]THEN #15=ATAN[#8]/[#7]
IF[#15LT0]THEN #15=#15+360
#16=0
IF[#14GT0]THEN #16=ATAN[#14]/[#9]
IF[[#14EQ0]AND[#9LT0]]THEN #16=180
#17=[#16-{{ "%.9f"|format(lowest_deg) }}]/{{ "%.9f"|format(polar_step_deg) }}
IF[#17LT0]THEN #17=0
#18=FIX[#17]
IF[#18GT{{ form.rows - 2 }}]THEN #18={{ form.rows - 2 }}
#19=#17-#18
IF[#19GT1]THEN #19=1
#20=#15/{{ "%.9f"|format(azimuth_step_deg) }}
#21=FIX[#20]
#22=#20-#21
{% for weight in catmull_rom("#19") %}
#{{ 23 + loop.index0 }}={{ weight }}
{% endfor %}
{% for weight in catmull_rom("#22") %}
#{{ 27 + loop.index0 }}={{ weight }}
{% endfor %}
#31=0
#100=0
WHILE[#31LT4]DO1
#32=#21+#31-1
IF[#32LT0]THEN #32=#32+{{ columns }}
IF[#32GE{{ columns }}]THEN #32=#32-{{ columns }}
#33={{ base }}+#18*{{ columns }}+#32
#1=#23*#[#33]+#24*#[#33+{{ columns }}]+#25*#[#33+{{ 2 * columns }}]+#26*#[#33+{{ 3 * columns }}]
#100=#100+#1*#[27+#31]
#31=#31+1
END1
IF[#16LT{{ "%.6f"|format(lowest_deg - 1e-3) }}]THEN #100=-1
IF[#16GT{{ "%.6f"|format(highest_deg + 1e-3) }}]THEN #100=-1
M99
%
