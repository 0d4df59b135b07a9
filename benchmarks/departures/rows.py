"""The rows of the table: each departure by the name that the command line takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from . import patterns, probes
from .departure import Departure
from .probes import MICROMETRE
from .tripod import SimulatedProbe

_SLOW_AND_FAST = {"delay": 2e-3, "feed": 50.0, "part_feed": 300.0}

_CHANGES: Mapping[str, tuple[str, Callable[[SimulatedProbe], SimulatedProbe]]] = {
    "same": ("an unchanged probe", lambda probe: probe),
    "rod_3": ("a probe with a rod 3° out since", partial(probes.with_rod_out, degrees=3.0)),
    "turn_2": ("a probe turned by 2° since", partial(probes.turned, degrees=2.0)),
    "turn_10": ("a probe turned by 10° since", partial(probes.turned, degrees=10.0)),
    "preload": ("a probe with a preload lower by 10 %", partial(probes.with_preload, factor=0.9)),
}


def _changed(name: str, count: int) -> Departure:
    title, change = _CHANGES[name]
    title = f"map of {title}, {count} planned touches"
    return Departure(title, check=count, change=lambda probe, _: change(probe))


_CHANGED = {f"{name}_{n}": _changed(name, n) for name in _CHANGES for n in (5, 9, 15)}

ROWS: Mapping[str, Departure] = {
    "baseline": Departure("baseline, noise 0.3 µm"),
    "baseline_usual": Departure(
        "baseline, with the usual errors that u contains", usual_errors=True
    ),
    "rod_10deg": Departure("one rod 10° out", make_probe=probes.rod_out),
    "five": Departure("five directions", directions=patterns.FIVE),
    "six": Departure("six directions", directions=patterns.SIX),
    "five_yielding": Departure(
        "five directions, pretravel 30 to 60 µm",
        directions=patterns.FIVE,
        make_probe=probes.yielding,
    ),
    "six_yielding": Departure(
        "six directions, pretravel 30 to 60 µm",
        directions=patterns.SIX,
        make_probe=probes.yielding,
    ),
    "nine": Departure("nine directions", directions=patterns.NINE),
    "fourteen": Departure("fourteen directions", directions=patterns.FOURTEEN),
    "five_azimuths": Departure(
        "sixteen directions, the same five azimuths in each ring", directions=patterns.FIVE_AZIMUTHS
    ),
    "five_azimuths_uneven": Departure(
        "very uneven probe, the same five azimuths in each ring",
        make_probe=probes.uneven,
        directions=patterns.FIVE_AZIMUTHS,
    ),
    "nine_usual": Departure(
        "nine directions, with these errors", directions=patterns.NINE, usual_errors=True
    ),
    "fourteen_usual": Departure(
        "fourteen directions, with these errors", directions=patterns.FOURTEEN, usual_errors=True
    ),
    "single": Departure("25 directions once", repeats=1),
    "uneven": Departure("very uneven probe, stylus of 100 mm", make_probe=probes.uneven),
    "prior_5": Departure("map of an aged probe, 5 planned touches", check=5),
    "prior_9": Departure("map of an aged probe, 9 planned touches", check=9),
    "prior_15": Departure("map of an aged probe, 15 planned touches", check=15),
    **_CHANGED,
    **{
        f"usual_{count}": Departure(
            f"map of an unchanged probe, {count} planned touches, with the usual errors",
            check=count,
            change=lambda probe, _: probe,
            usual_errors=True,
        )
        for count in (5, 9)
    },
    **{
        f"drifting_{count}": Departure(
            f"map of an unchanged probe, {count} planned touches, sphere drifts 4 µm",
            check=count,
            check_drift=4.0 * MICROMETRE,
            change=lambda probe, _: probe,
        )
        for count in (9, 15)
    },
    "quantised": Departure(
        "latch quantised to 1 µm, noise 0.1 µm", quantum=MICROMETRE, noise=0.1 * MICROMETRE
    ),
    "hysteresis_0.5": Departure("hysteresis 0.5 µm", hysteresis=0.5 * MICROMETRE),
    "hysteresis_1": Departure("hysteresis 1 µm", hysteresis=MICROMETRE),
    "hysteresis_1_passes": Departure(
        "hysteresis 1 µm, repeats in passes", hysteresis=MICROMETRE, order="passes"
    ),
    "hysteresis_1_shuffled": Departure(
        "hysteresis 1 µm, repeats in passes of random order",
        hysteresis=MICROMETRE,
        order="shuffled passes",
    ),
    "first_apart": Departure(
        "first touch of a direction 2 µm apart, on the part as the others",
        first_apart=(2.0 * MICROMETRE, 0.0),
    ),
    "first_apart_part": Departure(
        "first touch of a direction 2 µm apart, on the part too",
        first_apart=(2.0 * MICROMETRE, 2.0 * MICROMETRE),
    ),
    "diameter": Departure("sphere diameter 1 µm wrong", diameter_error=MICROMETRE),
    "diameter_u_given": Departure(
        "sphere diameter 1 µm wrong, its u given as 1 µm",
        diameter_error=MICROMETRE,
        options={"u_diameter": MICROMETRE},
    ),
    "squareness": Departure("squareness 10 µrad", squareness=10e-6),
    "friction": Departure("tip friction 0.2", make_probe=probes.rubbing_tip),
    "part_scatter": Departure(
        "scatter of 1.5 µm on the part, each place once", part_noise=1.5 * MICROMETRE
    ),
    "part_scatter_twice": Departure(
        "scatter of 1.5 µm on the part, each place twice",
        part_noise=1.5 * MICROMETRE,
        part_repeats=2,
    ),
    "part_friction": Departure(
        "tip friction 0.2, on the part 0.4", make_probe=probes.rubbing_tip, part_friction=0.4
    ),
    "part_friction_given": Departure(
        "tip friction 0.2, on the part 0.4, u of the friction given as 0.2",
        make_probe=probes.rubbing_tip,
        part_friction=0.4,
        u_friction=0.2,
    ),
    "noise_at_rods": Departure("noise three times larger at the rods", noise_at_rods=3.0),
    "feed_unknown": Departure("50, then 300 mm/min, 2 ms; feeds not stated", **_SLOW_AND_FAST),
    "feed_of_map": Departure(
        "50, then 300 mm/min, 2 ms; the map's feed stated",
        feed_stated=(True, False),
        **_SLOW_AND_FAST,
    ),
    "feed_of_part": Departure(
        "50, then 300 mm/min, 2 ms; the part's feed stated",
        feed_stated=(False, True),
        **_SLOW_AND_FAST,
    ),
    "feed_of_both": Departure(
        "50, then 300 mm/min, 2 ms; both feeds stated", feed_stated=(True, True), **_SLOW_AND_FAST
    ),
    "one_feed": Departure(
        "sphere and part at 300 mm/min, 2 ms; feeds stated",
        delay=2e-3,
        feed=300.0,
        part_feed=300.0,
        feed_stated=(True, True),
    ),
    "two_feeds": Departure(
        "50 and 300, then 300 mm/min, 2 ms; feeds stated",
        second_feed=300.0,
        repeats=4,
        feed_stated=(True, True),
        **_SLOW_AND_FAST,
    ),
    "turned_stated": Departure(
        "part touched with the spindle turned by 180°, both stated",
        spindle=(0.0, 180.0),
        spindle_stated=(True, True),
    ),
    "turned": Departure(
        "part touched with the spindle turned by 180°, nothing stated", spindle=(0.0, 180.0)
    ),
    "ring": Departure(
        "ring gauge, 24 directions", directions=patterns.RING_24, repeats=3, ring=True
    ),
    "ring_shuffled": Departure(
        "ring gauge, 24 directions, passes in random order",
        directions=patterns.RING_24,
        repeats=3,
        ring=True,
        order="shuffled passes",
    ),
    **{
        f"reversal_{count}": Departure(
            f"means of reversal, ring gauge, {count} directions",
            directions=patterns.rings((90.0, count, 0.0)),
            ring=True,
            reversal=True,
        )
        for count in (9, 12, 13, 15)
    },
    "ring_usual": Departure(
        "ring gauge, 24 directions, passes in random order, with these errors",
        directions=patterns.RING_24,
        repeats=3,
        ring=True,
        order="shuffled passes",
        usual_errors=True,
    ),
    "smooth_lobes": Departure(
        "smooth lobes of 8 µm, 92 touches without repeats",
        make_probe=probes.smooth_lobes,
        directions=patterns.SPREAD_92,
        repeats=1,
    ),
    "axial_2.5": Departure("pretravel along the axis 2.5 µm", make_probe=probes.stiff_pole_assumed),
    "drift": Departure("sphere drifts 2 µm, repeats in a row", drift=2.0 * MICROMETRE),
    "drift_6": Departure("sphere drifts 6 µm, repeats in a row", drift=6.0 * MICROMETRE),
    "drift_passes": Departure(
        "sphere drifts 2 µm, repeats in passes", drift=2.0 * MICROMETRE, order="passes"
    ),
    "drift_rings": Departure(
        "sphere drifts 6 µm, ring by ring", drift=6.0 * MICROMETRE, order="rings"
    ),
    "warming_rings": Departure(
        "machine warms up, sphere drifts 6 µm, ring by ring",
        drift=6.0 * MICROMETRE,
        drift_slows=True,
        order="rings",
    ),
    "sphere_stem": Departure("sphere stem bends 1 µm/N", stem_compliance=MICROMETRE),
    "sphere_stem_given": Departure(
        "sphere stem bends 1 µm/N, u of the diameter given as 0.6 µm",
        stem_compliance=MICROMETRE,
        options={"u_diameter": 0.6 * MICROMETRE},
    ),
    "backlash": Departure("backlash 0.5 µm", backlash=0.5 * MICROMETRE),
    "machine_scale": Departure("machine scale 10 ppm", scale=10e-6),
    "bent_stylus": Departure("bent stylus", make_probe=probes.bent_stylus),
    "star_stylus": Departure(
        "star stylus", make_probe=probes.star_stylus, directions=patterns.DENSE_45, repeats=2
    ),
    "strain_gauge": Departure("strain gauge", make_probe=probes.strain_gauge),
    "stylus_200": Departure("stylus of 200 mm", make_probe=probes.long_stylus),
    "bad_touch": Departure(
        "one of 81 touches 35 µm off",
        directions=patterns.THOROUGH_27,
        gross_errors=(35.0 * MICROMETRE,),
    ),
    "no_bad_touch": Departure("the same 81 touches without it", directions=patterns.THOROUGH_27),
    "false_trip": Departure(
        "one of 81 touches 1 mm off", directions=patterns.THOROUGH_27, gross_errors=(1.0,)
    ),
    "heavy_tails": Departure("noise 0.3 µm, Student's t with 3 degrees", heavy_tails=True),
}
