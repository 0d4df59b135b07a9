{% macro along(vector) %}[{{ vector[0]|plain }}]*#7+[{{ vector[1]|plain }}]*#8+[{{ vector[2]|plain }}]*#9{% endmacro %}
{% macro two_thirds() %}
#19=SQRT[#18]
#18=#19
#27=0
WHILE [#27 LT 10] DO1
#18=SQRT[SQRT[#18]]
#19=#19*#18
#27=#27+1
END1
{% endmacro %}
%
O{{ second }} (PRETRAVEL LOOKUP)
{% include "macro_b/head.nc" %}
(NEEDS NO TABLE OF VARIABLES)
(CALL G65 P{{ call }} I1. J0. K0. - THE NORMAL, IN THE ORDER I J K, WITH DECIMAL POINTS)
(RESULT #100 = PRETRAVEL ALONG THE NORMAL, IN {{ units|upper }})
(SURFACE POINT = CENTRE OF THE TIP AT THE TRIGGER - E * NORMAL)
(WITH E = TIP RADIUS - #100. X = #5061 - E * I, AND SO ON FOR Y AND J, Z AND K)
(ALARM 101 WRONG UNIT, 103 NO UNIT VECTOR, 104 OUTSIDE THE MAP)
#100=#0
IF [ABS[#4006-{{ unit_code }}] GT 0.5] GOTO 91
#14=SQRT[#4*#4+#5*#5+#6*#6]
IF [ABS[#14-1.0] GT 0.001] GOTO 93
(THE NORMAL ALONG THE AXES OF THE PROBE)
{% for axis in numbers.axes %}
#{{ 7 + loop.index0 }}=[{{ axis[0] }}]*#4+[{{ axis[1] }}]*#5+[{{ axis[2] }}]*#6
{% endfor %}
#14=SQRT[#7*#7+#8*#8]
(AZIMUTH #15 AND POLAR ANGLE #16 IN DEGREES)
{% include angles %}
{% if not numbers.within_deg[0].startswith("-") %}
IF [#16 LT {{ numbers.within_deg[0] }}] GOTO 94
{% endif %}
IF [#16 GT {{ numbers.within_deg[1] }}] GOTO 94
#10=0
{% if seats is not none %}
(THE TRIGGER FORCE - THE SMALLEST ONE AT WHICH A SEAT OPENS)
#17=999999.0
{% for seat in range(6) %}
#{{ 20 + seat }}={{ along(seats.response.reaction_change[seat]) }}
#18=999999.0
IF [#{{ 20 + seat }} LT -0.000001] THEN #18=0-{{ (seats.response.rest_reactions[seat] - seats.response.threshold)|plain }}/#{{ 20 + seat }}
IF [#18 LT #17] THEN #17=#18
{% endfor %}
IF [#17 GT 999998.0] GOTO 94
(BENDING OF THE PROBE)
{% for axis in range(3) %}
#{{ 11 + axis }}={{ along(seats.response.compliance[axis]) }}
{% endfor %}
#10=#17*[#7*#11+#8*#12+#9*#13]
(SEATS - THE POWER 2/3 BY SQUARE ROOTS)
{% for seat in range(6) %}
#18=[{{ seats.response.rest_reactions[seat]|plain }}]+#17*#{{ 20 + seat }}
IF [#18 LT 0] THEN #18=0
{{ two_thirds() -}}
#18={{ along(seats.response.seat_motion.T[seat]) }}
#10=#10+{{ seats.response.seat_coefficient|plain }}*[#19-{{ sunk_at_rest[seat]|plain }}]*#18
{% endfor %}
(TIP AND PART)
#18=#17
{{ two_thirds() -}}
#10=#10+{{ seats.response.tip_coefficient|plain }}*#19
#10={{ seats.scale|plain }}*#10+[{{ seats.constant|plain }}]+{{ along(seats.shift) }}
{% endif %}
{% if series is not none %}
(HARMONIC SERIES)
{% for order in series.orders %}
#18=COS[{{ order }}*#15]
#19=SIN[{{ order }}*#15]
#27=0
#28={{ sectoral_factor(order)|plain }}{{ "*#14" * order }}
{% for degree in range(order, series.highest_degree(order) + 1) %}
{% if degree > order %}
{% set a, b = recurrence(degree, order) %}
#29={{ a|plain }}*#9*#28-{{ b|plain }}*#27
#27=#28
#28=#29
{% endif %}
{% set cosine, sine = series.cosines[degree, order], series.sines[degree, order] %}
{% if cosine or sine %}
#10=#10+#28*[[{{ cosine|plain }}]*#18+[{{ sine|plain }}]*#19]
{% endif %}
{% endfor %}
{% endfor %}
{% endif %}
#100=[#10+{{ travel|plain }}]{{ "/25.4" if units == "inch" }}
M99
N91 #3000=101(PRETRAVEL IS IN {{ units|upper }})
N93 #3000=103(NORMAL NOT A UNIT VECTOR)
N94 #3000=104(OUTSIDE PRETRAVEL MAP)
M99
%
