"""The main job on example data: qualify, compensate, compare, and a page about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pretravel.arrays import BoolArray, FloatArray
from pretravel.compensation.comparison import compare_corrections
from pretravel.compensation.compensation import apply
from pretravel.directions import azimuth_angle, from_angles
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import read_csv_table
from pretravel.formats.map_file import write_map
from pretravel.formats.points import write_points
from pretravel.formats.touches_csv import read_touches
from pretravel.identification.kind_choice import distances_from_reference
from pretravel.identification.kinds import KINDS, qualify
from pretravel.qualification.qualification import Qualification
from pretravel.report.controls_words import comparison_report, plot_comparison
from pretravel.report.page import write_text_page
from pretravel.report.points_report import plot_points, points_document
from pretravel.report.qualification_report import plot_qualification, qualification_document
from pretravel.report.style import COLOURS, legend_below, new_figure, polar_axes, save
from pretravel.report.terminal import terminal_text
from pretravel.report.words import table
from pretravel.touches import Touches
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPHERE_DIAMETER = 24.9987
TIP_DIAMETER = 6.0
RING_DIAMETER = 50.0
"""Of the KP-3's ring gauge: not published, and without influence on the map. [mm]"""

_READ_SPHERE = """\
All numbers are root mean squares in µm; a single touch repeats to {noise}.
Fitted: what is left, on the sphere, of the touches that made the map.
Left out: what is predicted wrongly, on the sphere, in directions that the map was not shown (a
fifth of them at a time). A sector table needs all its directions, so none can be left out.
On the part: difference to the physical map at the part's 140 points, a shift of the whole part
taken off; it shows what the other kinds would cost there. The physical map's own error is not in
it: that is u_um in points.csv. The part's true form is not known here; its deviation from the
nominal is deviation_um. "Not compensated" takes off the tip radius alone, so the mean pretravel is
in its 16 µm."""
_READ_RING = """\
Real data: 72 directions, each read once off a published picture, to ±0.5 µm, the ring's centring
still in it. Fitted: every second direction, then the others; left out: the directions not shown.
The centring is fitted along. Neighbouring directions differ by about as much as the best kinds
leave."""

_CAPTIONS = {
    "qualification.png": "The probe on its reference sphere: pretravel seen from the spindle with "
    "the touched directions, over azimuth at four polar angles with the touches, and what is left.",
    "points.png": "The part: deviation from its nominal, pretravel taken off, uncertainty.",
    "compare.png": "What today's corrections would leave of this probe: over the azimuth on "
    "the equator, and the largest error over directions and on the part.",
    "kp3_ring.png": "A Centroid KP-3 in a ring gauge: pretravel over azimuth, and what each kind "
    "of map leaves when it is fitted to all directions.",
}
KIND_NAMES = {
    "mean": "mean radius",
    "sectors": "sector table",
    "wozniak": "Woźniak's constant",
    "harmonic": "harmonic map",
    "physical": "six-seat probe",
}
BEST = "physical"
"""The kind of map that the demonstration compensates the part with."""


def ring_touches(azimuth: FloatArray, pretravel: FloatArray) -> Touches:
    """Touches in a ring gauge from a table of pretravel over azimuth.

    Parameters
    ----------
    azimuth : (n,) float
        Of the side of the ring that is touched, seen from its centre. [rad]
    pretravel : (n,) float
        [mm]

    Returns
    -------
    Touches
        With a tip of `TIP_DIAMETER` in a ring of `RING_DIAMETER`.

    >>> ring_touches(np.array([0.0]), np.array([0.05])).positions.round(6).tolist()
    [[22.05, 0.0, 0.0]]
    """
    outward = from_angles(np.pi / 2.0, azimuth) * np.array([1.0, 1.0, 0.0])
    distance = 0.5 * (RING_DIAMETER - TIP_DIAMETER) + pretravel
    return Touches(positions=distance[:, None] * outward, normals=-outward)


def left_out_errors(
    touches: Touches,
    shown: Sequence[BoolArray],
    diameter: float,
    kind: str,
    *,
    ring: bool = False,
) -> FloatArray:
    """Errors of a kind of map in directions that it was not shown.

    Parameters
    ----------
    touches : Touches
        On a reference sphere or ring.
    shown : sequence of (n,) bool
        For each trial, the touches that the map is made from; the others are
        predicted, about the centre that goes with the map.
    diameter : float
        [mm]
    kind : str
    ring : bool

    Returns
    -------
    (m,) float
        Observed less predicted pretravel of the touches left out, trial by trial. [mm]
    """
    errors = []
    for mask in shown:
        made = qualify(
            touches.take(mask),
            diameter,
            kind=kind,
            ring=ring,
            tip_diameter=TIP_DIAMETER,
            search_outliers=False,
        )
        distance, _ = distances_from_reference(made, touches.take(~mask))
        errors.append(-distance if not ring else distance)
    return np.concatenate(errors)


def demonstrate(data: Path, output: Path) -> str:
    """Qualify on the sphere, compensate the part, compare kinds, draw, write a page.

    Parameters
    ----------
    data : Path
        Folder with sphere_touches.csv, part_touches.csv and kp3_ring.csv.
    output : Path
        Folder; made if it is not there.

    Returns
    -------
    str
        What was found, as text.

    Raises
    ------
    InputError
        Data that are missing or wrong.
    """
    if not data.is_dir():
        raise InputError(
            "there is no such folder; run this where examples/data is, or say --data", path=data
        )
    sphere = read_touches(data / "sphere_touches.csv")
    part = read_touches(data / "part_touches.csv")
    ring = _read_ring(data / "kp3_ring.csv")
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PretravelError(f"cannot make the folder {output}: {error.strerror}") from error

    best = qualify(sphere, SPHERE_DIAMETER, tip_diameter=TIP_DIAMETER, kind=BEST)
    points = apply(part, best.pretravel_map)
    compared = compare_corrections(best.pretravel_map, part.normals)
    write_map(output / "map.nc", best.pretravel_map)
    write_points(output / "points.csv", points)
    pictures = {
        "qualification.png": plot_qualification(best, "Reference sphere, six-seat probe fitted"),
        "points.png": plot_points(points, "The part, compensated"),
        "compare.png": plot_comparison(compared, "What corrections of today's controls leave"),
        "kp3_ring.png": _ring_picture(ring),
    }
    for name, figure in pictures.items():
        save(figure, output / name)

    noise = f"{best.repeatability / MICROMETRE:.2f}"
    sections = [
        (
            "The probe, qualified on the sphere",
            terminal_text(qualification_document(best), verbose=True),
        ),
        ("The part, compensated", terminal_text(points_document(points), verbose=True)),
        ("What each kind of map leaves, in µm", _sphere_and_part(sphere, part, best)),
        ("", _READ_SPHERE.format(noise=noise)),
        ("What today's corrections would leave of this probe", comparison_report(compared)),
        ("A Centroid KP-3 in a ring gauge (real), in µm", _ring_table(ring)),
        ("", _READ_RING),
    ]
    write_text_page(
        output / "index.html",
        "pretravel: from touches to compensated points",
        sections,
        {_CAPTIONS[name]: figure for name, figure in pictures.items()},
        files=("points.csv", "map.nc", *pictures),
    )
    text = "\n\n".join(f"{title}\n{body}".lstrip() for title, body in sections)
    return (
        f"{text}\n\nLook at {(output / 'index.html').resolve()}\n"
        "(points.csv, map.nc and the pictures are beside it)"
    )


def _rms(values: FloatArray) -> str:
    return f"{float(np.sqrt(np.mean(values**2))) / MICROMETRE:.2f}"


def _without_shift(values: FloatArray, normals: FloatArray) -> FloatArray:
    """Errors along normals less what a rigid translation explains of them."""
    shift = np.linalg.lstsq(normals, values, rcond=None)[0]
    return np.asarray(values - normals @ shift)


def _sphere_and_part(sphere: Touches, part: Touches, best: Qualification) -> str:
    made = {
        kind: best
        if kind == BEST
        else qualify(sphere, SPHERE_DIAMETER, kind=kind, tip_diameter=TIP_DIAMETER)
        for kind in KINDS
    }
    groups = best.groups
    shown = [groups % 5 != fold for fold in range(5)]
    reference = best.pretravel_map.pretravel(part.normals)
    observed = made["mean"].observed
    rows = [["not compensated", _rms(observed), "", _rms(_without_shift(reference, part.normals))]]
    for kind, result in made.items():
        difference = result.pretravel_map.pretravel(part.normals) - reference
        rows.append(
            [
                KIND_NAMES[kind],
                _rms(result.residuals),
                ""
                if kind == "sectors"
                else _rms(left_out_errors(sphere, shown, SPHERE_DIAMETER, kind)),
                _rms(_without_shift(difference, part.normals)),
            ]
        )
    return table(["", "fitted", "left out", "on the part"], rows)


def _read_ring(path: Path) -> Touches:
    rows = read_csv_table(path)
    rows.require("azimuth_deg", "pretravel_um", what="the ring table")
    values = rows.numbers("azimuth_deg", "pretravel_um")
    return ring_touches(values[:, 0] * DEGREE, values[:, 1] * MICROMETRE)


def _ring_table(ring: Touches) -> str:
    even = np.arange(len(ring)) % 2 == 0
    rows = []
    for kind in KINDS:
        fitted = [
            qualify(
                ring.take(half), RING_DIAMETER, kind=kind, ring=True, tip_diameter=TIP_DIAMETER
            ).residuals
            for half in (even, ~even)
        ]
        left_out = left_out_errors(ring, [even, ~even], RING_DIAMETER, kind, ring=True)
        rows.append([KIND_NAMES[kind], _rms(np.concatenate(fitted)), _rms(left_out)])
    return table(["", "fitted", "left out"], rows)


def _ring_picture(ring: Touches) -> Figure:
    made = {
        kind: qualify(ring, RING_DIAMETER, kind=kind, ring=True, tip_diameter=TIP_DIAMETER)
        for kind in KINDS
    }
    first = made["mean"]
    return plot_ring_kinds(
        azimuth_angle(-first.contact_normals),
        first.observed,
        {
            # About the mean's centre, as the measured values are: each kind has its own.
            KIND_NAMES[kind]: first.observed - result.residuals
            for kind, result in made.items()
        },
        "Centroid KP-3 in a ring gauge, fitted to all 72 directions, centring taken off",
    )


def plot_ring_kinds(
    azimuth: FloatArray, observed: FloatArray, kinds: Mapping[str, FloatArray], title: str
) -> Figure:
    """Pretravel on a ring and what several kinds of map make of it.

    Parameters
    ----------
    azimuth : (n,) float
        [rad]
    observed : (n,) float
        [mm]
    kinds : mapping of str to (n,) float
        Map values. [mm]
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 4.8)
    figure.suptitle(title)
    diagram = polar_axes(figure, 1, 2, 1, "pretravel / µm")
    order = np.append(np.argsort(azimuth), np.argsort(azimuth)[0])
    diagram.plot(azimuth, observed / MICROMETRE, "k.", ms=4, label="measured")
    left = figure.add_subplot(1, 2, 2)
    for colour, (name, values) in zip(COLOURS, kinds.items(), strict=False):
        diagram.plot(azimuth[order], values[order] / MICROMETRE, color=colour, lw=1.4, label=name)
        residual = (observed - values) / MICROMETRE
        left.plot(
            azimuth[order[:-1]] / DEGREE,
            residual[order[:-1]],
            color=colour,
            lw=1.2,
            label=f"{name}: {residual.std():.1f} µm",
        )
    diagram.set_ylim(bottom=0.0)
    legend_below(diagram, 4)
    left.axhline(0.0, color="k", lw=0.6)
    left.set_xlabel("azimuth / °")
    left.set_ylabel("left over / µm")
    left.set_title("what is left (standard deviation)", fontsize=11)
    left.legend(fontsize=8)
    return figure
