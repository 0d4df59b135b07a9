"""Statements that change tip, frame, unit, series, pass or part, as files of each format have them.

They are those of the formats' makers and users, not those of the readers' tables.
"""

from __future__ import annotations

_BEFORE = {
    "pcdmis": "F8  ", "dmis": "F(P2", "fusion": "G800 N2", "grbl": "<<< [PRB",
    "g2core": "{prb:{e:1",
    "klipper": "// probe at 97.000,2.000 is z=1.317500", "marlin": "Recv: 2 of 2",
    "reprap": "8.1.2023", "positions": "G1 X9", "probeopen": "9.000000", "csv": "b,9",
    "cmm-listing": "       PLANE", "cmm-centres": "13;3", "height-grid": "10 0 0.2",
    "linuxcnc": "touch,b", "trip-map": "60,8.0", "candle-map": "0.3;",
}  # fmt: skip
"""Begins the line before which a statement is inserted: between two readings."""
_SECOND_ROW = {
    "positions": "G1 X10.0 Y0.0 Z2.99\n",
    "probeopen": "10.000000 0.000000 2.990000 " + "0.000000 " * 5 + "0.000000\n",
    "csv": "b,9,0,2.99,0,0,1\n",
}
"""Samples of one row get another."""


def inserted(name: str, sample: str, line: str) -> tuple[str, int]:
    """A sample with a line between two of its readings, and the number of the line."""
    text = sample + _SECOND_ROW.get(name, "")
    begin = _SECOND_ROW[name] if name in _SECOND_ROW else _BEFORE[name]
    if name == "dmis":  # its second point has no measured one
        text = text.replace("ENDFIL", "FA(P2)=FEAT/POINT,CART,5,0,0.01,0,0,1\nENDFIL")
        begin = "FA(P2)"
    if name == "fusion":
        text = text.replace("END\n", "G801 N2 X1.3 Y0 Z0 R.0345\nEND\n")
    place = text.index(begin)
    return text[:place] + line + "\n" + text[place:], text[:place].count("\n") + 1


_CMM = {
    "pcdmis": {
        "tip": ("TIP/T2A90B0, SHANKIJK=0, 1, 0, ANGLE=0", "LOADPROBE/OTHER"),
        "frame": (
            "RECALL/ALIGNMENT,INTERNAL,A7", "A9 =ALIGNMENT/START,RECALL:A1,LIST=YES",
            "ROTAB/45.0,SHORTEST", "MOVE/ROTAB,90,CLOCKWISE", "ALIGNMENT/TRANS,ZAXIS,PLN1",
        ),
        "unit": ("UNITS/INCH",),
        "part": ("PART NAME  : SECOND", "SER NUMBER : 12"),
        "pass": ("TOUCHSPEED/ 1",), "radius": ("AUTOCALIBRATE/PROBE, SPHERE=QS1",),
    },
    "dmis": {
        "tip": ("SNSLCT/SA(TIP_1MM)", "SNSLCT/S(PROBE2)", "SA(OTHER)"),
        "frame": (
            "D(2)=DATSET/MCS", "RECALL/DA(2)", "DA(3)=TRANS/XORIG,5.0", "D(4)=ROTATE/ZAXIS,30",
            "DATSET/DAT(A),ZDIR", "ROTAB/RT(1),INCR,CW,90", "TRANS/ZORIG,FA(P1)", "ROTATE/ZAXIS,90",
        ),
        "unit": ("UNITS/INCH,ANGDEC",),
        "part": ("PS(2)=PARTSN/'17'", "FILNAM/'B',05.2", "LI(2)=LOTID/'7'", "DI(1)=DMEID/'M2'"),
        "pass": ("FEDRAT/MESVEL,MPM,0.1",), "radius": ("CALIB/SENS,S(PROBE2)",),
    },
    "fusion": {
        "tip": ("T5", "T5 M6"),
        "frame": ("G55", "G68 X0 Y0 R90."),
        "unit": ("G21",),
        "part": ("START", "RESULTSFILE Part2-RESULTS"),
    },
    "grbl": {
        "tip": (
            ">>> T2 M6", "> M6 T3", "> M61 Q2", ">>> (tip changed)",
            "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T2 F0 S0]",
        ),
        "frame": (
            "> G55", "> G10 L20 P1 Z0", "> G92 X0",
            "<Idle|MPos:0.000,0.000,0.000|WCO:-90.000,50.000,-20.000>", "> G68 X0 Y0 R45",
            "> $100=80", "> G0 A90", "> G1 X1 B-30 F100", "M19 S90", "ALARM:1", "[MSG:Homing]",
        ),
        "unit": ("$13=1",),
    },
    "g2core": {
        "tip": ("T2 M6", "M6 T2"),
        "frame": (
            "G55", '{"g55z":-3.000}', "G28.2 Z0", "G43 H1", '{"1tr":5.000}', "M19 S90",
            '{"r":{"fv":0.99,"msg":"SYSTEM READY"},"f":[1,0,9]}',
        ),
    },
    "klipper": {
        "tip": ("T1", "ACTIVATE_EXTRUDER EXTRUDER=extruder1"),
        "frame": ("SET_KINEMATIC_POSITION Z=10", "G92 Z0"),
        "series": ("G28 Z", "Z_TILT_ADJUST", "// Klipper state: Ready"),
        "pass": ("PROBE_ACCURACY PROBE_SPEED=2",),
    },
    "marlin": {
        "tip": ("T1",), "frame": ("Send: G92 Z0", "M92 Z400"), "series": ("Send: G28", "start"),
    },
    "positions": {
        "tip": ("T2",), "frame": ("G55", "G92 X0", "G10 L2 P1 Z5"), "unit": ("G20",),
        "relative": ("G91", "G16", "G7"), "orientation": ("M19 S90",), "part": ("O1234",),
    },
    "probeopen": {"frame": ("G55", "10 0 3 0 0 45 0 0 0")},
    "csv": {
        "radius": ("# radius compensation on",), "tip": ("# tip 2", "TIP;2"),
        "unit": ("# units: inch",), "frame": ("# G55",),
    },
    "cmm-listing": {"frame": ("       PLANE OTHER CART PCS MM ANGDEC 09:31 May 04,2026",)},
    "cmm-centres": {"tip": ("TIP 2",)},
    "height-grid": {"tip": ("TIP 2",)},
    "candle-map": {"tip": ("TIP 2",), "frame": ("1;2;3",)},
    "linuxcnc": {"tip": ("tool,2,end",), "frame": ("work,G55,0,end",)},
    "reprap": {
        "tip": ("T1", "M558 K1 P8"), "frame": ("G92 Z0", "G31 P500 Z1.2"), "series": ("G28",),
    },
    "trip-map": {"tip": ("TIP 2",), "part": ("Probe 8",)},
}  # fmt: skip
WITHOUT_LINES = {"qif", "print"}
"""Documents of elements, and features: no line stands between two touches."""
INSERTED = [
    (name, kind, line)
    for name, kinds in _CMM.items()
    for kind, lines in kinds.items()
    for line in lines
]
"""Format, what the statement changes, and the statement."""
UNKNOWN = {
    "pcdmis": "FROBNICATE/3", "dmis": "FROBNI/3", "fusion": "FROB 3", "grbl": "Frobnicating 3",
    "g2core": "Frobnicating 3", "klipper": "frobnicating 3", "marlin": "frobnicating 3",
    "reprap": "frobnicating 3", "positions": "frobnicating 3", "probeopen": "frobnicating 3",
    "csv": "frobnicating 3", "candle-map": "frobnicating 3",
    "cmm-centres": "frobnicating 3", "linuxcnc": "frob,3,end",
}  # fmt: skip
"""A line of each format that nobody knows."""
