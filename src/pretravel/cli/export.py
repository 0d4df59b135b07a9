from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pretravel.cli.arguments import one_of
from pretravel.cli.files import check_files

CONTROLS = ("linuxcnc", "renishaw", "fanuc", "heidenhain", "csv")
_MOST = {"linuxcnc": 1900, "fanuc": 400}


def _warn_of(error: float, tolerance_um: float) -> None:
    from pretravel.units import MICROMETRE

    if error > tolerance_um * MICROMETRE:
        typer.echo(
            f"Warning: the table misses --tolerance {tolerance_um:g} µm (its error is "
            f"{error / MICROMETRE:.3f} µm): there are too few variables for a finer one",
            err=True,
        )


def export(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help="Map: .nc, or a .csv table.")],
    to: Annotated[
        str,
        typer.Option(
            parser=one_of(lambda: CONTROLS),
            metavar="CONTROL",
            help="linuxcnc (a folder of subroutines), renishaw (vector radii), fanuc (Macro B), "
            "heidenhain (from a template, not verified), csv (a table of effective radii).",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File; for linuxcnc the folder of subroutines."),
    ] = None,
    form: Annotated[
        Literal["auto", "formula", "table"],
        typer.Option(
            help="linuxcnc: formula (exact: harmonic, mean and physical maps), table "
            "(interpolated) or auto."
        ),
    ] = "auto",
    tolerance: Annotated[
        float,
        typer.Option(
            min=1e-6, max=1000.0, help="Largest deviation of a table from the map, in µm."
        ),
    ] = 0.02,
    base: Annotated[
        int | None, typer.Option(help="First variable: linuxcnc 3000, renishaw and fanuc 500.")
    ] = None,
    criterion: Annotated[
        Literal["max", "rms"],
        typer.Option(help="renishaw: the residual to minimise, the largest or the rms."),
    ] = "max",
    template: Annotated[
        Path | None, typer.Option(help="heidenhain: the template to fill in.")
    ] = None,
    show_template: Annotated[
        bool, typer.Option("--show-template", help="heidenhain: print the template to edit.")
    ] = False,
    azimuth: Annotated[
        float | None,
        typer.Option(help="heidenhain: azimuth of all touches, in degrees."),
    ] = None,
    feed: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=1e6,
            help="Measuring feed, in mm/min, for tables of a map that contains the signal delay; "
            "the subroutines for linuxcnc use the feed of each touch.",
        ),
    ] = None,
    tip_diameter: Annotated[
        float | None,
        typer.Option(help="Diameter of the tip, in mm; the default is that of the map."),
    ] = None,
) -> None:
    """Export a map as tables and macros for a control.

    Example: pretravel export map.nc --to linuxcnc -o subroutines
    """
    from pretravel.controls import tables
    from pretravel.controls.linuxcnc_subroutines import LAST_FREE, linuxcnc_subroutines
    from pretravel.controls.lookup import describe_form, exact_lookup, lookup_table
    from pretravel.errors import PretravelError
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.map_file import effective_radius_table, read_map
    from pretravel.units import DEGREE, MICROMETRE, delay_travel
    from pretravel.whole_file import whole_file

    if show_template:
        typer.echo(tables.heidenhain_template(), nl=False)
        return
    if output is None:
        raise PretravelError("say where to write to: -o FILE, for linuxcnc -o FOLDER")
    pretravel_map = read_map(map_file, tip_diameter=tip_diameter)
    travel = 0.0
    if pretravel_map.delay is not None and to != "linuxcnc":
        if feed is None:
            raise PretravelError(
                f"this map is one of the probe at rest and knows a signal delay of "
                f"{1e3 * pretravel_map.delay:.3f} ms; a table holds for one feed: say --feed"
            )
        travel = delay_travel(feed, pretravel_map.delay)
    elif feed is not None:
        raise PretravelError("--feed goes with tables of a map that knows the signal delay")
    if to == "linuxcnc":
        first = 3000 if base is None else base
        if not 31 <= first < LAST_FREE - 500:
            raise PretravelError(f"--base {first}: parameters 31 to 5000 are the user's")
        if output.suffix or output.is_file():
            raise PretravelError(f"-o {output}: a folder is needed; it takes several subroutines")
        if not output.parent.is_dir():
            raise PretravelError(f"cannot make {output}: the folder {output.parent} does not exist")
        exact = None if form == "table" else exact_lookup(pretravel_map)
        if exact is None and form == "formula":
            raise PretravelError(
                f"a map of kind {pretravel_map.kind} has no formula for a control: --form table"
            )
        chosen = exact or lookup_table(
            pretravel_map,
            tolerance=tolerance * MICROMETRE,
            most_values=min(_MOST["linuxcnc"], LAST_FREE - first),
        )
        texts = linuxcnc_subroutines(pretravel_map, chosen, base=first)
        output.mkdir(exist_ok=True)
        stale = output / "pretravel_table.ngc"
        if stale.name not in texts:
            stale.unlink(missing_ok=True)
        for name, text in texts.items():
            with whole_file(output / name) as temporary:
                temporary.write_text(text, encoding="ascii")
        typer.echo(f"{output}: {', '.join(sorted(texts))}")
        typer.echo(describe_form(chosen))
        if exact is None:
            _warn_of(chosen.largest_error, tolerance)
        return
    check_files([(output, (output.suffix.lower(),))], [map_file, *([template] if template else [])])
    if to == "csv":
        check_files([(output, (".csv",))])
        write_csv_table(output, effective_radius_table(pretravel_map, travel))
        typer.echo(f"{output}: effective radii over the supported directions")
        return
    if to == "renishaw":
        text = tables.renishaw_variables(
            pretravel_map, base=500 if base is None else base, criterion=criterion, travel=travel
        )
    elif to == "fanuc":
        table = lookup_table(
            pretravel_map, tolerance=tolerance * MICROMETRE, most_values=_MOST["fanuc"]
        )
        text = tables.fanuc_macro(
            pretravel_map, table, base=500 if base is None else base, travel=travel
        )
        _warn_of(table.largest_error, tolerance)
    else:
        own = None
        if template is not None:
            try:
                own = template.read_text(encoding="utf-8-sig")
            except (OSError, UnicodeDecodeError) as error:
                raise PretravelError(f"{template}: cannot be read as text: {error}") from None
        text = tables.heidenhain_table(
            pretravel_map, own, azimuth=None if azimuth is None else azimuth * DEGREE, travel=travel
        )
    with whole_file(output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    typer.echo(f"{output}:")
    remarks = [line for line in text.splitlines()[:8] if line.startswith(("(", ";"))]
    typer.echo("\n".join(remarks))
    if to == "heidenhain":
        typer.echo("Warning: the columns are unverified: compare with your control's", err=True)
