from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import ModelName, PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


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
        Path | None,
        typer.Option(
            "--output", "-o", help="The identified description, .toml; or a page, .html or .pdf."
        ),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Identify quantities of a probe's description from a measured map.

    Example: pretravel identify map.nc --probe omp40-2 --free rotation,stem_diameter -o mine.toml
    """
    from pretravel.base.whole_file import write_text
    from pretravel.files.map_file import read_map
    from pretravel.identification.probe_from_map import identified_description
    from pretravel.identification.probe_from_map import identify as fit
    from pretravel.prediction.catalogue import load_probe, parse_probe, source_text
    from pretravel.tasks.reports.identification_report import identification_document

    check_files([(output, (".toml", *PAGES)), (plot, PICTURES)], [map_file, probe])
    description = load_probe(probe)
    pretravel_map = read_map(map_file)
    names = [name.strip() for name in free.split(",") if name.strip()]
    with working("identifying"):
        found = fit(pretravel_map, description, names, model=model)
    if output is not None and not is_page(output):
        text = identified_description(source_text(probe), found, map_file.name)
        parse_probe(text, str(output), output.parent)
        write_text(output, text)
    report = identification_document(found, model=model, map_name=map_file.name)
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
