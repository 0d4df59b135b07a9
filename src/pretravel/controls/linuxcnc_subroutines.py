"""O-word subroutines of LinuxCNC that compensate on the control: no Python is needed there."""

from __future__ import annotations

import math

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.controls.linuxcnc import (
    COMPENSATED,
    LOG_HEAD,
    MEASURED,
    POINT_COLUMNS,
    POINT_LOG_COLUMNS,
    TO_MICROMETRES,
    comment,
)
from pretravel.controls.lookup import (
    Lookup,
    LookupSeats,
    LookupSeries,
    LookupTable,
    catmull_rom_text,
    describe_form,
    recurrence,
    sectoral_factor,
)
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.touches import GLANCING
from pretravel.units import DEGREE, INCH

LAST_FREE = 5000
"""Parameters 31 to 5000 are the user's; they are kept while the control runs."""


def linuxcnc_subroutines(
    pretravel_map: PretravelMap, form: Lookup, *, base: int = 3000
) -> dict[str, str]:
    """Subroutines that look a map up, probe and compensate.

    Parameters
    ----------
    pretravel_map : PretravelMap
        What directions it holds for, tip radius, signal delay.
    form : LookupSeries, LookupSeats or LookupTable
        Of that map.
    base : int
        First parameter for a table.

    Returns
    -------
    mapping of str to str
        Text by file name: each a subroutine of the name of the file, for the folder that
        SUBROUTINE_PATH names.
    """
    source = pretravel_map.provenance.get("source", "")
    feed = pretravel_map.feed
    head = [
        (
            f"(pretravel: map of kind {pretravel_map.kind}"
            f"{comment(f' from {source}') if source else ''})"
        ),
        f"({describe_form(form)})",
        (
            f"(holds {form.band.lowest / DEGREE:.2f} to {form.band.highest / DEGREE:.2f} "
            "degrees from the probe axis; stops the program outside)"
        ),
        f"(tip radius {pretravel_map.tip_radius:.7f} mm)",
    ]
    if pretravel_map.delay is not None:
        head.append(f"(signal delay {1e3 * pretravel_map.delay:.4f} ms, taken off by the feed)")
    elif feed is not None:
        head.append(f"(made at {feed:g} mm/min: measure at that feed)")
    files = {
        "pretravel_lookup.ngc": _lookup(pretravel_map, form, head, base),
        "pretravel_compensate.ngc": _compensate(pretravel_map, head),
        "pretravel_point.ngc": _point(pretravel_map, head),
        "pretravel_head.ngc": _head(head),
    }
    if isinstance(form, LookupTable):
        files["pretravel_table.ngc"] = _table(form, head, base)
    return {name: "\n".join(lines) + "\n" for name, lines in files.items()}


def _lookup(pretravel_map: PretravelMap, form: Lookup, head: list[str], base: int) -> list[str]:
    turn = pretravel_map.rotation
    # To the probe frame: the transposed rotation.
    to_probe = [
        f"#<p{axis}> = [" + "+".join(
            f"[{_exact(turn[machine, column])}]*#<m{'xyz'[machine]}>" for machine in range(3)
        ) + "]"
        for column, axis in enumerate("xyz")
    ]  # fmt: skip
    slack = 1e-6
    lines = [
        *head,
        "(call with an outward unit normal of the part, work coordinates: #1 #2 #3)",
        "(gives the pretravel along it, mm, in #<_value>)",
        "o<pretravel_lookup> sub",
        "#<length> = SQRT[#1*#1+#2*#2+#3*#3]",
        "o<pretravel_unit> if [ABS[#<length>-1] GT 0.001]",
        "(ABORT,pretravel_lookup: the normal #1 #2 #3 is not a unit vector)",
        "o<pretravel_unit> endif",
        "(turn of the active work coordinates, then of the probe in the machine)",
        "#<base> = [5210+20*#5220]",
        "#<turn> = #[#<base>]",
        "#<mx> = [[#1*COS[#<turn>]-#2*SIN[#<turn>]]/#<length>]",
        "#<my> = [[#1*SIN[#<turn>]+#2*COS[#<turn>]]/#<length>]",
        "#<mz> = [#3/#<length>]",
        *to_probe,
        "#<across> = SQRT[#<px>*#<px>+#<py>*#<py>]",
        "#<azimuth> = 0",
        "o<pretravel_pole> if [#<across> GT 0]",
        "#<azimuth> = ATAN[#<py>]/[#<px>]",
        "o<pretravel_pole> endif",
        "#<polar> = 0",
        "o<pretravel_axis> if [#<across> GT 0 OR #<pz> LT 0]",
        "#<polar> = ATAN[#<across>]/[#<pz>]",
        "o<pretravel_axis> endif",
        (
            "o<pretravel_outside> if [#<polar> LT "
            f"{_exact(form.band.lowest / DEGREE - slack)} OR #<polar> GT "
            f"{_exact(form.band.highest / DEGREE + slack)}]"
        ),
        "(ABORT,pretravel_lookup: the map does not hold #<polar> degrees from the probe axis)",
        "o<pretravel_outside> endif",
    ]
    if isinstance(form, LookupSeries):
        lines += _series(form)
    elif isinstance(form, LookupSeats):
        lines += _seats(form)
    else:
        lines += _interpolate(form, base)
    return [*lines, "o<pretravel_lookup> endsub [#<sum>]"]


def _series(form: LookupSeries) -> list[str]:
    lines = ["#<sum> = 0"]
    for order in form.orders:
        lines += [
            f"(order {order})",
            f"#<cosine> = COS[{order}*#<azimuth>]",
            f"#<sine> = SIN[{order}*#<azimuth>]",
            "#<before> = 0",
            f"#<now> = [{_exact(sectoral_factor(order))}"
            + (f"*#<across>**{order}]" if order else "]"),
        ]
        for degree in range(order, form.highest_degree(order) + 1):
            if degree > order:
                a, b = recurrence(degree, order)
                lines += [
                    f"#<next> = [{_exact(a)}*#<pz>*#<now>-{_exact(b)}*#<before>]",
                    "#<before> = #<now>",
                    "#<now> = #<next>",
                ]
            c, s = form.cosines[degree, order], form.sines[degree, order]
            if c or s:
                lines.append(
                    f"#<sum> = [#<sum>+#<now>*[[{_exact(c)}]*#<cosine>+[{_exact(s)}]*#<sine>]]"
                )
    return lines


def _seats(form: LookupSeats) -> list[str]:
    """The force at which the first seat opens; what bends and gives under it."""
    response, axes = form.response, "xyz"

    def along(vector: FloatArray) -> str:
        return "+".join(f"[{_exact(v)}]*#<p{a}>" for v, a in zip(vector, axes, strict=True))

    lines = ["#<force> = -1"]
    for seat in range(6):
        margin = response.rest_reactions[seat] - response.threshold
        lines += [
            f"#<change{seat}> = [{along(response.reaction_change[seat])}]",
            f"o<pretravel_seat{seat}> if [#<change{seat}> LT -0.000000000001]",
            f"#<own> = [0-{_exact(margin)}/#<change{seat}>]",
            f"o<pretravel_first{seat}> if [#<force> LT 0 OR #<own> LT #<force>]",
            "#<force> = #<own>",
            f"o<pretravel_first{seat}> endif",
            f"o<pretravel_seat{seat}> endif",
        ]
    lines += [
        "o<pretravel_never> if [#<force> LT 0]",
        "(ABORT,pretravel_lookup: the probe does not trigger in this direction)",
        "o<pretravel_never> endif",
        "(what bends)",
        *(f"#<c{axes[i]}> = [{along(response.compliance[i])}]" for i in range(3)),
        "#<own> = [#<force>*[#<px>*#<cx>+#<py>*#<cy>+#<pz>*#<cz>]]",
        "(what the seats give)",
    ]
    for seat in range(6):
        rest = response.rest_reactions[seat]
        lines += [
            f"#<load> = [{_exact(rest)}+#<force>*#<change{seat}>]",
            f"o<pretravel_open{seat}> if [#<load> LT 0]",
            "#<load> = 0",
            f"o<pretravel_open{seat}> endif",
            f"#<sunk> = [#<load>**[2/3]-{_exact(float(np.cbrt(rest**2)))}]",
            (
                f"#<own> = [#<own>+{_exact(response.seat_coefficient)}*#<sunk>*"
                f"[{along(response.seat_motion[:, seat])}]]"
            ),
        ]
    return [
        *lines,
        "(tip on part; the reference's own shift)",
        f"#<own> = [#<own>+{_exact(response.tip_coefficient)}*#<force>**[2/3]]",
        f"#<sum> = [{_exact(form.scale)}*#<own>+[{_exact(form.constant)}]+{along(form.shift)}]",
    ]


def _interpolate(form: LookupTable, base: int) -> list[str]:
    columns = form.values.shape[1]
    return [
        f"o<pretravel_load> if [#{base} NE {form.number}]",
        "o<pretravel_table> call",
        f"o<pretravel_stale> if [#{base} NE {form.number}]",
        "(ABORT,pretravel_lookup: pretravel_table.ngc belongs to another map)",
        "o<pretravel_stale> endif",
        "o<pretravel_load> endif",
        (
            f"#<down> = [[#<polar>-{_exact(form.band.lowest / DEGREE)}]/"
            f"{_exact(form.polar_step / DEGREE)}]"
        ),
        "o<pretravel_up> if [#<down> LT 0]",
        "#<down> = 0",
        "o<pretravel_up> endif",
        "#<i> = FIX[#<down>]",
        f"o<pretravel_last> if [#<i> GT {form.rows - 2}]",
        f"#<i> = {form.rows - 2}",
        "o<pretravel_last> endif",
        "#<f> = [#<down>-#<i>]",
        "o<pretravel_end> if [#<f> GT 1]",
        "#<f> = 1",
        "o<pretravel_end> endif",
        f"#<around> = [#<azimuth>/{_exact(form.azimuth_step / DEGREE)}]",
        "#<j> = FIX[#<around>]",
        "#<g> = [#<around>-#<j>]",
        *_weights("f", "d"),
        *_weights("g", "w"),
        *(f"#<j{b}> = [[#<j>+{b + columns - 1}] MOD {columns}]" for b in range(4)),
        f"#<row> = [{base + 1}+#<i>*{columns}]",
        "#<sum> = 0",
        *(
            f"#<sum> = [#<sum>+#<d{a}>*["
            + "+".join(f"#<w{b}>*#[#<row>+{a * columns}+#<j{b}>]" for b in range(4))
            + "]]"
            for a in range(4)
        ),
    ]


def _weights(share: str, name: str) -> list[str]:
    """Of four neighbours, at a share from the second to the third."""
    texts = enumerate(catmull_rom_text(f"#<{share}>"))
    return [f"#<{name}{i}> = [{text}]" for i, text in texts]


def _table(form: LookupTable, head: list[str], base: int) -> list[str]:
    values = form.values.ravel()
    return [
        *head,
        f"(fills parameters {base} to {base + len(values)}; pretravel_lookup calls it when needed)",
        "o<pretravel_table> sub",
        *(f"#{base + 1 + index} = {_exact(value)}" for index, value in enumerate(values)),
        f"#{base} = {form.number}",
        "o<pretravel_table> endsub",
    ]


def _compensate(pretravel_map: PretravelMap, head: list[str]) -> list[str]:
    delay = pretravel_map.delay or 0.0
    return [
        *head,
        "(after a touch: outward unit normal #1 #2 #3, direction of travel #4 #5 #6, feed #7,)",
        "(nominal point #8 #9 #10; work coordinates, units of the program)",
        "(sets #<_pretravel_x> _y _z: surface point; #<_pretravel_travel>: the pretravel along)",
        "(the normal; #<_pretravel_deviation>: from the nominal point along the normal)",
        "o<pretravel_compensate> sub",
        "#<unit> = 1",
        "o<pretravel_inch> if [#<_metric> EQ 0]",
        f"#<unit> = [1/{INCH}]",
        "o<pretravel_inch> endif",
        "#<length> = SQRT[#1*#1+#2*#2+#3*#3]",
        "#<way> = SQRT[#4*#4+#5*#5+#6*#6]",
        "o<pretravel_unit> if [ABS[#<length>-1] GT 0.001 OR ABS[#<way>-1] GT 0.001]",
        "(ABORT,pretravel_compensate: normal and direction of travel must be unit vectors)",
        "o<pretravel_unit> endif",
        *(f"#{i} = [#{i}/#<length>]" for i in (1, 2, 3)),
        *(f"#{i} = [#{i}/#<way>]" for i in (4, 5, 6)),
        "#<closing> = [0-[#1*#4+#2*#5+#3*#6]]",
        f"o<pretravel_closing> if [#<closing> LT {GLANCING}]",
        "(ABORT,pretravel_compensate: the travel must go against the outward normal)",
        "o<pretravel_closing> endif",
        "o<pretravel_lookup> call [#1] [#2] [#3]",
        "#<_pretravel_travel> = [#<_value>*#<unit>]",
        f"#<back> = [#<_pretravel_travel>/#<closing>+{_exact(delay)}*#7/60]",
        f"#<radius> = [{_exact(pretravel_map.tip_radius)}*#<unit>]",
        "#<_pretravel_x> = [#5061-#<back>*#4-#<radius>*#1]",
        "#<_pretravel_y> = [#5062-#<back>*#5-#<radius>*#2]",
        "#<_pretravel_z> = [#5063-#<back>*#6-#<radius>*#3]",
        "#<dx> = [#<_pretravel_x>-#8]",
        "#<dy> = [#<_pretravel_y>-#9]",
        "#<dz> = [#<_pretravel_z>-#10]",
        "#<_pretravel_deviation> = [#<dx>*#1+#<dy>*#2+#<dz>*#3]",
        "(the same in micrometres, for logs: the control prints what is below 1e-4 as zero)",
        *(
            f"#<_pretravel_{name}_um> = [#<_pretravel_{name}>*1000/#<unit>]"
            for name in ("x", "y", "z", "travel", "deviation")
        ),
        "o<pretravel_compensate> endsub",
    ]


def _point(pretravel_map: PretravelMap, head: list[str]) -> list[str]:
    scaled = {
        **{f"n{axis}": f"#{4 + i}*1000000" for i, axis in enumerate("xyz")},
        **{f"a{axis}": f"0-#{4 + i}*1000000" for i, axis in enumerate("xyz")},
        **{f"nominal_{axis}": f"#{1 + i}*1000" for i, axis in enumerate("xyz")},
    }
    normal, approach, nominal = (
        ",".join(f"#<log_{name}>" for name in list(scaled)[k : k + 3]) for k in (0, 3, 6)
    )
    told = f"{normal},{approach},#7,{nominal}"
    return [
        *head,
        "(probes one point along its normal; straight from where the tip is to the start:)",
        "(surface point #1 #2 #3, outward unit normal #4 #5 #6, measuring feed #7, number #8;)",
        "(distance of the start #9, overtravel #10, positioning feed #11: 2 mm, 2 mm, 1000 mm/min)",
        "(when not given. Logs touch and surface point into the open log: LOGOPEN and)",
        "(o<pretravel_head> call before the first. #<_pretravel_touched> is 1, or 0 for a miss)",
        "o<pretravel_point> sub",
        "o<pretravel_absolute> if [#<_absolute> EQ 0]",
        "(ABORT,pretravel_point: positions must be absolute, G90)",
        "o<pretravel_absolute> endif",
        "#<length> = SQRT[#4*#4+#5*#5+#6*#6]",
        "o<pretravel_unit> if [ABS[#<length>-1] GT 0.001]",
        "(ABORT,pretravel_point: the normal must be a unit vector)",
        "o<pretravel_unit> endif",
        *(f"#{i} = [#{i}/#<length>]" for i in (4, 5, 6)),
        "#<unit> = 1",
        "o<pretravel_inch> if [#<_metric> EQ 0]",
        f"#<unit> = [1/{INCH}]",
        "o<pretravel_inch> endif",
        "#<start> = #9",
        "o<pretravel_start> if [#9 LE 0]",
        "#<start> = [2*#<unit>]",
        "o<pretravel_start> endif",
        "#<over> = #10",
        "o<pretravel_over> if [#10 LE 0]",
        "#<over> = [2*#<unit>]",
        "o<pretravel_over> endif",
        "#<quick> = #11",
        "o<pretravel_quick> if [#11 LE 0]",
        "#<quick> = [1000*#<unit>]",
        "o<pretravel_quick> endif",
        f"#<far> = [{_exact(pretravel_map.tip_radius)}*#<unit>+#<start>]",
        f"#<near> = [{_exact(pretravel_map.tip_radius)}*#<unit>-#<over>]",
        "#<ax> = [0-#4]",
        "#<ay> = [0-#5]",
        "#<az> = [0-#6]",
        "#<sx> = [#1+#<far>*#4]",
        "#<sy> = [#2+#<far>*#5]",
        "#<sz> = [#3+#<far>*#6]",
        "G1 X#<sx> Y#<sy> Z#<sz> F#<quick>",
        "G38.3 X[#1+#<near>*#4] Y[#2+#<near>*#5] Z[#3+#<near>*#6] F#7",
        "#<gone> = [ABS[#5061-#<sx>]+ABS[#5062-#<sy>]+ABS[#5063-#<sz>]]",
        "o<pretravel_stuck> if [#5070 EQ 1 AND #<gone> LT [0.002*#<unit>]]",
        "(ABORT,the probe was tripped where the touch should start)",
        "o<pretravel_stuck> endif",
        "G1 X#<sx> Y#<sy> Z#<sz> F#<quick>",
        "#<_pretravel_touched> = #5070",
        "o<pretravel_metric> if [#<_metric> EQ 1]",
        *TO_MICROMETRES.splitlines(),
        *(f"#<log_{name}> = [{value}]" for name, value in scaled.items()),
        f"(LOG,touch,p%d#8,%.4f{MEASURED},{told},#5070,end)",
        "o<pretravel_metric> endif",
        "o<pretravel_hit> if [#5070 EQ 1]",
        "o<pretravel_compensate> call [#4] [#5] [#6] [#<ax>] [#<ay>] [#<az>] [#7] [#1] [#2] [#3]",
        "o<pretravel_metric_2> if [#<_metric> EQ 1]",
        f"(LOG,point,p%d#8,%.4f{COMPENSATED},end)",
        "o<pretravel_metric_2> endif",
        "o<pretravel_hit> endif",
        "o<pretravel_point> endsub",
    ]


def _head(head: list[str]) -> list[str]:
    return [
        *head,
        "(writes the first lines of a log, after LOGOPEN; the program must be in mm, G21)",
        "o<pretravel_head> sub",
        "o<pretravel_mm> if [#<_metric> EQ 0]",
        "(ABORT,pretravel_head: logs are in mm, G21)",
        "o<pretravel_mm> endif",
        "#<base> = [5210+20*#5220]",
        "#<turn> = #[#<base>]",
        f"(LOG,{LOG_HEAD},1,points,0,end)",
        "(LOG,%.9fwork,#5220,#<turn>,end)",
        f"(LOG,columns,{','.join(POINT_LOG_COLUMNS)},end)",
        f"(LOG,point-columns,{','.join(POINT_COLUMNS)},end)",
        "o<pretravel_head> endsub",
    ]


def _exact(value: float) -> str:
    """Every digit, without an exponent, which the interpreter does not take."""
    text = f"{float(value) + 0.0:.20f}".rstrip("0").rstrip(".")
    if value and math.isclose(float(text or 0), value, rel_tol=1e-12):
        return text
    return f"{float(value) + 0.0:.30f}".rstrip("0").rstrip(".") if value else "0"
