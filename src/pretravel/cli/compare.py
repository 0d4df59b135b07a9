from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def compare(
    map_file: Annotated[
        str,
        typer.Argument(
            metavar="MAP", help="Map: .json or .csv; or a probe, whose map is predicted."
        ),
    ],
    other: Annotated[
        str | None,
        typer.Argument(
            metavar="PROBE", help="A second probe: both are described ones, and are compared."
        ),
    ] = None,
    part: Annotated[
        Path | None,
        typer.Option(
            help="Touches or targets of a part, to compare there too. Of a table the columns "
            "nx,ny,nz (or I,J,K) are read alone: its unit does not matter."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Table: .csv, .json; or a page, .html or .pdf."),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Compare the errors that corrections leave, from none to the full map; or two probes.

    The corrections are none, one mean radius, two axis radii, four directions, eight sectors as
    touched and as resampled, Woźniak's constant and the full map; the errors are those on the
    equator, in all directions and on a part, in µm. With two probes (names of the catalogue or
    .toml), their predicted force, pretravel and elastic parts are compared.

    Example: pretravel compare map.json --part part.csv --plot compare.png

    Example: pretravel compare omp40-2 mine.toml -o designs.html
    """
    from pretravel.files.readings import read_directions
    from pretravel.files.tables import write_table
    from pretravel.tasks.compare import compare_map
    from pretravel.tasks.map_argument import map_or_prediction
    from pretravel.tasks.reports.comparison_report import comparison_columns

    if other is not None:
        return _compare_designs((map_file, other), part, output, plot, verbose)
    check_files([(output, (".csv", ".json", *PAGES)), (plot, PICTURES)], [map_file, part])
    with working("comparing"):
        pretravel_map = map_or_prediction(map_file)
        normals = None if part is None else read_directions(part)
        result = compare_map(pretravel_map, normals)
    report = result.document(Path(map_file).name)
    if output is not None and not is_page(output):
        write_table(output, comparison_columns(result.comparison))
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
    return None


def _compare_designs(
    names: tuple[str, str], part: Path | None, output: Path | None, plot: Path | None, verbose: bool
) -> None:
    from pretravel.base.errors import PretravelError
    from pretravel.files.tables import write_table
    from pretravel.tasks.compare_designs import compare_designs
    from pretravel.tasks.reports.design_comparison_report import design_comparison_columns

    check_files([(output, (".csv", ".json", *PAGES)), (plot, PICTURES)], [*names, part])
    maps = [name for name in names if Path(name).suffix.lower() not in (".toml", "")]
    if maps:
        raise PretravelError(
            f"{maps[0]} is not the description of a probe. compare takes one map, or two probes "
            "(names of pretravel probes, or .toml)"
        )
    if part is not None:
        raise PretravelError("a part is compared with a map, not with two probes; leave it out",
                             inputs=("part",))  # fmt: skip
    with working("comparing"):
        result = compare_designs(*names)
    report = result.document((Path(names[0]).name, Path(names[1]).name))
    if output is not None and not is_page(output):
        write_table(output, design_comparison_columns(result.triggers))
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
