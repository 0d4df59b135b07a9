from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PICTURES, check_files
from pretravel.cli.options import ModelName, Picture
from pretravel.cli.progress import working


def identify(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help="Map from qualify: .nc or .csv.")],
    probe: Annotated[str, typer.Option(help="Initial description: catalogue name or TOML file.")],
    free: Annotated[
        str,
        typer.Option(
            help="Quantities to fit, a,b,…: preload, lever, tripod_radius, support_angle, "
            "ball_radius, rod_radius, stem_diameter, rotation, rod_azimuth_1, _2, _3."
        ),
    ] = "rotation,stem_diameter",
    model: ModelName = "analytic",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The identified description, .toml.")
    ] = None,
    plot: Picture = None,
) -> None:
    """Identify quantities of a probe's description from a measured map.

    Example: pretravel identify map.nc --probe omp40-2 --free rotation,stem_diameter -o mine.toml
    """
    from pretravel.formats.map_file import read_map
    from pretravel.identification.probe import FREE
    from pretravel.identification.probe import identify as fit
    from pretravel.probe.catalogue import (
        catalogue_names,
        description_text,
        load_probe,
        parse_probe,
        rewritten,
    )
    from pretravel.report.laboratory_words import identification_report
    from pretravel.whole_file import whole_file

    check_files([(output, (".toml",)), (plot, PICTURES)], [map_file, probe])
    description = load_probe(probe)
    pretravel_map = read_map(map_file)
    names = [name.strip() for name in free.split(",") if name.strip()]
    with working("identifying"):
        found = fit(pretravel_map, description, names, model=model)
    if output is not None:
        text = (
            description_text(probe)
            if probe in catalogue_names()
            else Path(probe).read_text(encoding="utf-8-sig")
        )
        changes = {}
        for name, value, u in zip(
            found.names, found.values, found.standard_uncertainty, strict=True
        ):
            number = FREE[name]
            written = value - description.stylus_length if name == "lever" else value
            changes[f"{number.table}.{number.key}"] = (
                float(f"{written / number.unit:.9g}"),
                f"identified from {map_file.name}, u = {u / number.unit:.2g}",
            )
        text = rewritten(text, changes)
        parse_probe(text, str(output), output.parent)
        with whole_file(output) as temporary:
            temporary.write_text(text, encoding="utf-8")
    if plot is not None:
        from pretravel.report.laboratory_pictures import plot_identification
        from pretravel.report.style import save

        save(plot_identification(found, f"{map_file.name}, {description.name}"), plot)
    typer.echo(identification_report(found, model))
    for sentence in found.unknown:
        typer.echo(f"Warning: {sentence}", err=True)
