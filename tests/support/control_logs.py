"""Small logs and result files as controls, CMMs and CAM write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pretravel.controls.program_log import TOUCH_COLUMNS
from pretravel.files.file_format import ReadingOptions
from pretravel.files.logs.qif import NAMESPACE
from pretravel.touches.targets import Targets

OWN_LOG_HEAD = (
    "pretravel-log,1,plan,2,end\nwork,G54,30.0000000,end\ncolumns," + ",".join(TOUCH_COLUMNS)
    + ",end\n"
)  # fmt: skip
OWN_LOG_TOUCH = "touch,{label},0.0,0.0,2990.0,0,0,1,0,0,-1,50,0,0,0,{touched},end\n"
OWN_LOG = (
    OWN_LOG_HEAD + OWN_LOG_TOUCH.format(label="a", touched="1.0000000")
    + OWN_LOG_TOUCH.format(label="b", touched="0.0000000") + "done,2,end\n"
)  # fmt: skip
PROBEOPEN_ROW = "{x:.6f} 0.000000 2.990000 " + "0.000000 " * 5 + "0.000000\n"
GRBL_LOG = (
    "Grbl 1.1f ['$' for help]\n$13=0 (report in inches)\n"
    "<Idle|MPos:0.000,0.000,0.000|WCO:-100.000,50.000,-20.000>\n"
    "[22:44:43] [ G38.3 Z-5 F100 ] [PRB:-100.000,50.000,-17.010:1]\nok\n"
    "<<< [PRB:-90.000,50.000,-17.020:1]\n"
    "[G54:-100.000,50.000,-20.000]\n[TLO:0.000]\n[PRB:-90.000,50.000,-17.020:1]\n"
    "ALARM:5\n[PRB:-75.000,50.000,-25.000:0]\n"
)
# The forms are those of postprocessors; the numbers of the first are computed by hand.
FUSION_HAAS = (
    "RESULTSFILE a\nSTART\nTOOLPATHID 12\nG330 N1 A0. B0. C0. X0 Y0 Z0 I0 R0\n"
    "G800 N1 X-0.4394 Y0.5291 Z-0.0753 I0.63893 J-0.76927 K0. O0. U0.005 L0.005\n"
    "G801 N1 X-.4187 Y.5040 Z-.0753 R.0345\n"
    "G800 N2 X1. Y0 Z0 I1 J0 K0 O0U0.01L-0.01\nEND\n"
)
QIF_FILE = (
    f'<?xml version="1.0"?><QIFDocument xmlns="{NAMESPACE}" versionQIF="3.0.0" idMax="9">'
    '<QPId>fd43400a-29bf-4ec6-b96c-e2f846eb6ff6</QPId>UNITS<Results><MeasurementResultsSet n="1">'
    '<MeasurementResults id="8"><MeasuredPointSets n="1"><MeasuredPointSet count="2" id="7">'
    "<Points>0 0 3 10 0 3</Points><Normals>0 0 1 0 0 1</Normals><Compensated>false</Compensated>"
    "<ProbeRadius>2.5</ProbeRadius></MeasuredPointSet></MeasuredPointSets><InspectionStatus>"
    "<InspectionStatusEnum>PASS</InspectionStatusEnum></InspectionStatus></MeasurementResults>"
    "</MeasurementResultsSet></Results></QIFDocument>"
)
DMIS_OUTPUT = (
    "$$ a comment\nFILNAM/'OUT'\nUNITS/MM, ANGDEC\n"
    "F(P1)=FEAT/POINT,CART,0,0,0,0,0,1\nFA(P1) = Feat/Point, CART, 0.0, $\n 0.0, 0.01, 0,0,1\n"
    "FA(C1)=FEAT/CIRCLE,INNER,CART,50,50,40,0,0,1,50\n"
    "F(P2)=FEAT/POINT,CART,5,0,0,0,0,1\nENDFIL\n"
)
PRINT_FILE = (
    "-----------\n   COMPONENT NO 1      FEATURE NO 2\n-----------\n"
    "SIZE D71.0000   ACTUAL 71.9072   TOL 0.1000   DEV 0.9072\n"
    "          +++++OUT OF TOL+++++ ERROR  0.8072\n"
    "POSN X 10.0000   ACTUAL 10.0100   DEV .0100\nPOSN Z0   ACTUAL NaN   DEV NaN\n"
)
G2CORE_LOG = (
    '{"sr":{"posz":-17.000,"vel":20.00}}\n'
    '{"r":{"prb":{"e":1,"x":-100.000,"y":50.000,"z":-17.010,"a":0.000}},"f":[1,0,0,1397]}\n'
    '{"prb":n}\n{"r":{"prb":{"e":1,"x":-100.000,"y":50.000,"z":-17.010,"a":0.000}},"f":[1,0,9]}\n'
    "{prb:{e:1,x:-90.000,y:50.000,z:-17.020,a:0.000}}\n"
    '{"prb":{"e":0,"x":-75.000,"y":50.000,"z":-25.000,"a":0.000}}\n'
)
KLIPPER_LOG = (
    "Recv: // probe at 78.000,31.000 is z=2.410000\n"
    "Recv: // PROBE_ACCURACY at X:97.000 Y:2.000 Z:3.315 (samples=2 retract=2.000)\n"
    "Recv: // probe at 97.000,2.000 is z=1.320000\n// probe at 97.000,2.000 is z=1.317500\n"
    "Recv: // probe accuracy results: maximum 1.320000, minimum 1.317500\n"
    "10:14 PROBE_ACCURACY at X:97.000 Y:2.000 Z:3.315 (samples=1)\n"
    "10:14 // probe at 97.000,2.000 is z=1.320000\n"
)
MARLIN_LOG = (
    "Send: M48 P2 V4\nRecv: M48 Z-Probe Repeatability Test\nRecv: Positioning the probe...\n"
    "Recv: Bed X: 68.000 Y: 100.000 Z: -0.042\n"
    "22:09:05.997: 1 of 2: **z: -0.036** mean: -0.0363 sigma: 0.000000 min: -0.036\n"
    "Recv: 2 of 2: z: -0.037 Mean: -0.036600 Sigma: 0.000236 Min: -0.037\n"
    "Recv: Mean: -0.036600 Min: -0.037 Max: -0.036 Range: 0.001\n"
    "Recv: Standard Deviation: 0.000236\nRecv: Bed X: 15.000 Y: 30.000 Z: 0.123\n"
)
REPRAP_LOG = (
    "Stopped at height 0.012 mm\n8.1.2023, 01:29:16\tG32 bed probe heights: -0.005 0.001, "
    "mean -0.002, deviation from mean 0.003\n"
)
PC_DMIS_ROUTINE = (
    "A1         =ALIGNMENT/START,RECALL:STARTUP,LIST=YES\n           ALIGNMENT/END\n"
    "PNT1       =FEAT/CONTACT/VECTOR POINT/DEFAULT,CARTESIAN\n"
    "            THEO/<0,0,5>,<0,0,1>\n            ACTL/<0,0,5.012>,<0,0,1>\n"
    "            TARG/<0,0,5>,<0,0,1>\n            SNAP=NO\n"
    "CIR1       =FEAT/CIRCLE,CARTESIAN,IN,LEAST_SQR\n"
    "            THEO/<10,0,-2>,<0,0,1>,20\n            ACTL/<10.001,0,-2>,<0,0,1>,20.02\n"
    "            MEAS/CIRCLE,2,WORKPLANE\n"
    "              HIT/BASIC,NORMAL,<20,0,-2>,<-1,0,0>,<20.011,0,-2>,USE THEO=YES\n"
    "              HIT/BASIC,NORMAL,<0,0,-2>,<1,0,0>,$\n              <-0.009,0,-2>,USE THEO=YES\n"
    "            ENDMEAS/\n"
    "CIR2       =FEAT/CONTACT/CIRCLE/DEFAULT,CARTESIAN,IN,LEAST_SQR\n"
    "            THEO/<50,0,-2>,<0,0,1>,8\n            ACTL/<50,0,-2>,<0,0,1>,8.01\n"
    "F7         =FEAT/POINT,RECT\nTHEO/7.5,2,1,0,0,1\nACTL/7.5,2,1,0,0,1\nREADPOINT/\n"
    "F8         =FEAT/POINT,RECT\nTHEO/7.5,2,5,0,0,1\nACTL/7.5,2,5.01,0,0,1\n"
)
PC_DMIS_REPORT_FILE = (
    "\nPART NAME  : BRACKET\nDIM #2LOC1= LOCATION OF PLANE PLN4  UNITS=MM\n"
    "AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL\n"
    "Y       42.500      0.200      0.200     42.520      0.020      0.000 ----#----\n"
)
# What is recognised and refused, and words that the refusal contains.
REFUSED_FILES: dict[str, tuple[tuple[str, ...], str]] = {
    "pcdmis-report": (
        (PC_DMIS_REPORT_FILE,),
        "dimensions of features",
    ),
    "calypso": (
        ("planid\tpartnb\tid\ttype\tidsymbol\tactual\tnominal\n\t1\tD1\tdiameter\t\t8.01\t8\n",),
        "Calypso",
    ),
    "feature-list": (
        (
            "Name,Type,Center X,Center Y,Center Z,I,J,K,Diameter\nC1,CIRCLE,4,5,-6,0,0,1,10\n",
            "Name,Type,X,Y,Z,I,J,K\nA,POINT,4,5,0.1,0,0,1\nB,CIRCLE,9,5,-6,0,0,1\nC,POINT,1,5,0.2,0,0,1\n",
            "Object Name,Control,Nom,Meas,Dev,Test\nbore,Diameter,10,10.01,0.01,Pass\n",
        ),
        "list of features",
    ),
    "listing": (
        ("QUINDOS V7\nELE NAM\nP1 A 1.5\n", "Calibrating Probe With Bore\nBore diameter: 20.022\n"),
        "a report of a CMM",
    ),
    "heidenhain-log": (
        (
            "Measuring log Probing cycle 421 Hole Measuring\nDate: 30-06-2005\nTime: 6:55:04\n",
            "**********\nMessprotokoll Antastzyklus 421 Bohrung messen\n",
            "VS75=12.345 VS76=-5.000 VS78=25.012\n",
            "Date;Cycle;X set;X act;Y act;Z act\n1;CYCLE978;1;1.1;2;3\n2;CYCLE977;1;1.1;2;3\n",
        ),
        "one by one",
    ),
    "bed-mesh": (
        (
            "// Mesh Leveling Probed Z positions:\n// 0.01 0.02\n",
            "Bilinear Leveling Grid:\n      0      1\n 0 +0.01 -0.02\n",
            "RepRapFirmware height map file v2 generated at 2021-05-01\nxmin,xmax\n",
        ),
        "mesh of heights",
    ),
    "i++": (
        (
            "00014 PtMeas(X(1.0),Y(2.0),Z(3.0),IJK(0,0,1))\n00014 # X(1.0), Y(2.0)\n",
            "E0000 # PtMeas(X(-711.2),Y(863.4),Z(400.6),IJK(-0.37,0.0,0.93),R(1.17))\n",
        ),
        "I.. DME",
    ),
    "geometry": (
        (
            "ISO-10303-21;\nHEADER;\n",
            "solid part\n  facet normal 0 0 1\n    outer loop\n",
            "ply\nformat ascii 1.0\n",
        ),
        "nominal surface",
    ),
    "document": (("<!DOCTYPE html>\n<html>\n", "%PDF-1.7\n"), "Save the table"),
    "program": (
        (
            "%\nO1000\nG21 G90\nG38.2 Z-10 F100\nM30\n",
            "G20\n#100 = 5\no<probe> call [1]\n",
            "0 BEGIN PGM CHECK1 MM\n1 TOOL CALL 1 Z\n",
            "N10 G65 P9810 Z#5 F1000.\n",
            "DPRNT[G800*N1*X1.*Y2.]\n",
            "G0X0Y0\nM3S12000\nG1X1Y1Z1\n",
        ),
        "program of a control",
    ),
}
CMM_LISTING_FILE = """\
      CIRCLE HOLE1 CART MCS MM ANGDEC 09:30 May 04,2026
X          10.0000     10.0020      0.0020      0.0500     -0.0500   ----*++++
Y          20.0000     19.9990     -0.0010      0.0500     -0.0500   ----*++++
Z           5.0000      5.0000      0.0000      0.0500     -0.0500   ----*++++
I           0.0000      0.0000      0.0000
J           0.0000      0.0000      0.0000
K           1.0000      1.0000      0.0000
D          20.0000     20.0100      0.0100      0.0500     -0.0500   ----*++++
Cirlty                  0.0120      0.0120      0.0000                  0.0120
PtNo          X            Y            Z       DX       DY       DZ      DEV
   1      20.0130      19.9990       5.0000   0.0060   0.0000   0.0000   0.0060
   2      10.0020      29.9980       5.0000  -0.0000  -0.0060   0.0000  -0.0060
   3      -0.0090      19.9990       5.0000  -0.0060   0.0000   0.0000   0.0060
   4      10.0020      10.0000       5.0000   0.0000   0.0060   0.0000  -0.0060
Max error = 0.006000 at Point 1
________________________________________
       PLANE TOP CART MCS MM ANGDEC 09:31 May 04,2026
X          15.0000     15.0000      0.0000      0.0500     -0.0500   ----*++++
Y          10.0000     10.0000      0.0000      0.0500     -0.0500   ----*++++
Z           8.0000      8.0010      0.0010      0.0500     -0.0500   ----*++++
I           0.0000      0.0000      0.0000
J           0.0000      0.0000      0.0000
K           1.0000      1.0000      0.0000
Flat                    0.0040      0.0040      0.0000                  0.0040
PtNo          X            Y            Z       DX       DY       DZ      DEV
   1       0.0000       0.0000       8.0030   0.0000   0.0000   0.0020   0.0020
   2      30.0000       0.0000       7.9990   0.0000   0.0000  -0.0020  -0.0020
   3      30.0000      20.0000       8.0030   0.0000   0.0000   0.0020   0.0020
   4       0.0000      20.0000       7.9990   0.0000   0.0000  -0.0020  -0.0020
Max error = 0.002000 at Point 1
________________________________________
"""
"""A hole and a face, computed by hand."""
HEIGHT_GRID_FILE = (
    "0.0 10.0 2\n0.0 5.0 2\n-1.0 1.0 50\n\n\n0 0 0.1\n10 0 0.2\n\n0 5 0.1\n10 5 0.3\n\n"
)
CANDLE_MAP_FILE = "0;0;10;5\r\n2;2;-1;1\r\n0;1;1\r\n0.1;0.2\r\n0.3;0.4\r\n"
CMM_CENTRES_FILE = (
    "12;3;a no compensation;1;0.3000;0.2000;2.9900;;0.0000\r\n"
    "13;3;a no compensation;1;-0.4000;0.1000;2.9910;;0.0000\r\n"
    "17;4;wall no compensation;1;23.0100;0.4000;-5.2000;;0.0000\r\n"
)
PLAN = Targets(
    np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 0, 0], [20.0, 0, -5]]),
    np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]]),
    labels=("a", "b.1", "b.2", "wall"),
)

GRBL_OPTIONS = ReadingOptions(plan=PLAN, tip_radius=3.0)
G2CORE_OPTIONS = ReadingOptions(plan=PLAN, tip_radius=3.0, offset=(-100.0, 50.0, -20.0))
TRIP_MAP_FILE = (
    "Probe 7\nangle_deg,trip_um,untrip_um\n0,16.0,9.0\n60,8.0,5.0\n120,16.0,9.0\n180,8.0,5.0\n"
    "240,16.0,9.0\n300,8.0,5.0\n"
)
TRIP_MAP_OPTIONS = ReadingOptions(ring=True, reference_diameter=50.0, tip_radius=3.0)
CENTRES_OPTIONS = ReadingOptions(plan=PLAN, tip_radius=3.0, units="mm", join="feature")
POSITIONS_OPTIONS = ReadingOptions(plan=PLAN, tip_radius=3.0, units="mm", overtravel=2.0)
SAMPLES: dict[str, tuple[str, ReadingOptions | None]] = {
    "csv": ("label,x_mm,y_mm,z_mm,nx,ny,nz\na,0,0,2.99,0,0,1\n", None),
    "linuxcnc": (OWN_LOG, None),
    "probeopen": (PROBEOPEN_ROW.format(x=0.0), POSITIONS_OPTIONS),
    "positions": ("G21\nG1 X0.0 Y0.0 Z2.99\n", POSITIONS_OPTIONS),
    "grbl": (GRBL_LOG, GRBL_OPTIONS),
    "g2core": (G2CORE_LOG, G2CORE_OPTIONS),
    "klipper": (KLIPPER_LOG, None),
    "marlin": (MARLIN_LOG, None),
    "reprap": (REPRAP_LOG, ReadingOptions(look_only=True)),
    "pcdmis": (PC_DMIS_ROUTINE, ReadingOptions(radius_taken_off=3.0, units="mm")),
    "fusion": (FUSION_HAAS, ReadingOptions(units="inch")),
    "qif": (QIF_FILE.replace("UNITS", ""), None),
    "dmis": (DMIS_OUTPUT, ReadingOptions(radius_taken_off=3.0)),
    "cmm-listing": (CMM_LISTING_FILE, ReadingOptions(radius_taken_off=1.0, bores=("HOLE*",))),
    "cmm-centres": (CMM_CENTRES_FILE, CENTRES_OPTIONS),
    "height-grid": (HEIGHT_GRID_FILE, ReadingOptions(units="mm")),
    "candle-map": (CANDLE_MAP_FILE, ReadingOptions(units="mm")),
    "trip-map": (TRIP_MAP_FILE, TRIP_MAP_OPTIONS),
    "print": (PRINT_FILE, ReadingOptions(units="mm")),
}
"""A file of each text format that is read, and what the user must add to it."""


def written(tmp_path: Path, text: str | bytes, name: str = "file.txt") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
