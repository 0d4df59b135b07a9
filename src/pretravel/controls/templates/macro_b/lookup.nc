%
O{{ second }} (PRETRAVEL LOOKUP)
{% include "macro_b/head.nc" %}
(RUN O{{ first }} ONCE FIRST. ITS TABLE IS IN #{{ base }} TO #{{ base + table.values|length }})
(CALL G65 P{{ call }} I1. J0. K0. - THE NORMAL, IN THE ORDER I J K, WITH DECIMAL POINTS)
(RESULT #100 = PRETRAVEL ALONG THE NORMAL, IN {{ units|upper }})
(SURFACE POINT = CENTRE OF THE TIP AT THE TRIGGER - E * NORMAL)
(WITH E = TIP RADIUS - #100. X = #5061 - E * I, AND SO ON FOR Y AND J, Z AND K)
(ALARM 101 WRONG UNIT, 102 NO TABLE, 103 NO UNIT VECTOR, 104 OUTSIDE THE MAP, 107 TABLE CHANGED)
#100=#0
IF [ABS[#4006-{{ unit_code }}] GT 0.5] GOTO 91
IF [ABS[#{{ base }}-{{ table.number }}] GT 0.5] GOTO 92
#14=SQRT[#4*#4+#5*#5+#6*#6]
IF [ABS[#14-1.0] GT 0.001] GOTO 93
(THE SUM OF THE TABLE - HAS ANOTHER PROGRAM WRITTEN INTO IT)
#31=0
#32={{ base + 1 }}
WHILE [#32 LE {{ base + table.values|length }}] DO1
#31=#31+#[#32]
#32=#32+1
END1
IF [ABS[#31-[{{ table.checksum }}]] GT {{ table.checksum_tolerance }}] GOTO 95
(THE NORMAL ALONG THE AXES OF THE PROBE)
{% for axis in table.axes %}
#{{ 7 + loop.index0 }}=[{{ axis[0] }}]*#4+[{{ axis[1] }}]*#5+[{{ axis[2] }}]*#6
{% endfor %}
#14=SQRT[#7*#7+#8*#8]
(AZIMUTH #15 AND POLAR ANGLE #16 IN DEGREES)
{% include angles %}
{% if not table.within_deg[0].startswith("-") %}
IF [#16 LT {{ table.within_deg[0] }}] GOTO 94
{% endif %}
IF [#16 GT {{ table.within_deg[1] }}] GOTO 94
(THE ROW OF THE TABLE, AND THE SHARE OF THE WAY TO THE NEXT ROW)
#17=[#16-{{ table.lowest_deg }}]/{{ table.polar_step_deg }}
IF [#17 LT 0] THEN #17=0
#18=FIX[#17]
IF [#18 GT {{ table.rows - 4 }}] THEN #18={{ table.rows - 4 }}
#19=#17-#18
IF [#19 GT 1.0] THEN #19=1.0
(THE COLUMN, AND THE SHARE)
#20=#15/{{ table.azimuth_step_deg }}
#21=FIX[#20]
#22=#20-#21
{% for weight in catmull_rom("#19") %}
#{{ 23 + loop.index0 }}={{ weight }}
{% endfor %}
{% for weight in catmull_rom("#22") %}
#{{ 27 + loop.index0 }}={{ weight }}
{% endfor %}
(FOUR COLUMNS OF FOUR ROWS)
#31=0
#10=0
WHILE [#31 LT 4] DO1
#32=#21+#31-1
IF [#32 LT 0] THEN #32=#32+{{ table.columns }}
IF [#32 GE {{ table.columns }}] THEN #32=#32-{{ table.columns }}
#33={{ base + 1 }}+#18*{{ table.columns }}+#32
#1=#23*#[#33]+#24*#[#33+{{ table.columns }}]
#1=#1+#25*#[#33+{{ 2 * table.columns }}]+#26*#[#33+{{ 3 * table.columns }}]
#10=#10+#1*#[27+#31]
#31=#31+1
END1
#100=#10
M99
N91 #3000=101(PRETRAVEL TABLE IS IN {{ units|upper }})
N92 #3000=102(PRETRAVEL TABLE IS MISSING)
N93 #3000=103(NORMAL NOT A UNIT VECTOR)
N94 #3000=104(OUTSIDE PRETRAVEL MAP)
N95 #3000=107(PRETRAVEL TABLE CHANGED)
M99
%
