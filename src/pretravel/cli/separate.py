from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import PICTURES, check_files, pair, working
from pretravel.cli.options import Picture


def separate(
    readings: Annotated[Path, typer.Argument(help="CSV: machine_index,probe_index,error_um.")],
    repeat_variance: Annotated[
        float | None,
        typer.Option(help="Variance of one configuration, measured by repeats, µm²."),
    ] = None,
    repeat_pair: Annotated[
        str | None, typer.Option(help="That configuration: machine,probe index.")
    ] = None,
    repeat_count: Annotated[int, typer.Option(help="Repeats behind that variance.")] = 10,
    method: Annotated[
        str, typer.Option(help="reml (restricted likelihood) or least-squares (the paper's).")
    ] = "reml",
    pair_of: Annotated[
        list[str] | None,
        typer.Option("--pair", help="Print the variance of this pair too: machine,probe index."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Result: .csv or .json, or a page, .html.")
    ] = None,
    plot: Picture = None,
) -> None:
    """Tell machine from probe: systematic errors and variances from multi-step readings.

    A reading is the machine's error less the probe's, in one of many combinations.

    Example: pretravel separate readings.csv --repeat-variance 0.8 --repeat-pair 1,1 -o s.csv
    """
    import json

    from pretravel.errors import PretravelError
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.separation_csv import read_readings, separation_json, separation_table
    from pretravel.laboratory import separation
    from pretravel.report.laboratory_pictures import plot_separation
    from pretravel.report.laboratory_words import separation_report
    from pretravel.units import MICROMETRE
    from pretravel.whole_file import whole_file

    check_files([(output, (".csv", ".json", ".html")), (plot, PICTURES)], [readings])
    if (repeat_variance is None) != (repeat_pair is None):
        raise PretravelError("--repeat-variance and --repeat-pair go together: which, and how much")
    square = MICROMETRE**2
    repeated = None
    if repeat_variance is not None and repeat_pair is not None:
        machine, probe = _indices(repeat_pair, "--repeat-pair")
        repeated = separation.RepeatedPair(
            machine, probe, repeat_variance * square, count=repeat_count
        )
    wanted = [_indices(text, "--pair") for text in pair_of or []]
    measured = read_readings(readings)
    with working(f"separating {len(measured)} readings"):
        result = separation.separate(measured, method=method, repeated=repeated)  # type: ignore[arg-type]
    pairs = []
    for machine, probe in wanted:
        variance, u = result.pair_variance(machine, probe)
        low, high = result.pair_interval(machine, probe)
        pairs.append(
            f"pair ({machine}, {probe}): variance {variance / square:.4f} µm², u = "
            f"{u / square:.4f} µm², 95 % interval {low / square:.4f} to {high / square:.4f} µm²"
        )
    if output is not None and output.suffix.lower() == ".csv":
        write_csv_table(output, separation_table(result))
    elif output is not None and output.suffix.lower() == ".json":
        with whole_file(output) as temporary:
            temporary.write_text(json.dumps(separation_json(result), indent=1), encoding="utf-8")
    elif output is not None:
        from pretravel.report.page import write_text_page

        write_text_page(
            output,
            f"pretravel separate: {readings.name}",
            [("Result", "\n".join([separation_report(result), "", *pairs]))],
            {"Errors and variances": plot_separation(result)},
        )
    if plot is not None:
        from pretravel.report.plotting import save

        save(plot_separation(result, f"{readings.name}: machine and probe"), plot)
    typer.echo("\n".join([separation_report(result), *([""] if pairs else []), *pairs]))


def _indices(text: str, name: str) -> tuple[int, int]:
    from pretravel.errors import PretravelError

    first, second = pair(text, name)
    if first != round(first) or second != round(second):
        raise PretravelError(f"{name} {text}: expected two whole numbers, for example 1,1")
    return int(first), int(second)


def separation_plan(
    directions: Annotated[int, typer.Option(help="Of machine and probe, equally spaced.")] = 24,
    variance: Annotated[
        float, typer.Option(help="Expected variance of a touch, machine and probe together, µm².")
    ] = 0.5,
    u_systematic: Annotated[
        float | None, typer.Option("--u-systematic", help="Wanted of each error, µm.")
    ] = None,
    u_variance: Annotated[
        float | None,
        typer.Option("--u-variance", help="Wanted of each direction's variance, % of it."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Every touch in order, a form to fill in: .csv."),
    ] = None,
) -> None:
    """Plan a multi-step test: orientations and repeats for a wanted uncertainty.

    Example: pretravel separation-plan --directions 24 --variance 0.4 --u-systematic 0.2 -o form.csv
    """
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.separation_csv import separation_plan_table
    from pretravel.laboratory.separation_plan import plan_separation
    from pretravel.report.laboratory_words import separation_plan_report
    from pretravel.units import MICROMETRE

    check_files([(output, (".csv",))])
    with working("planning"):
        plan = plan_separation(
            directions,
            variance * MICROMETRE**2,
            u_error=None if u_systematic is None else u_systematic * MICROMETRE,
            u_variance=None if u_variance is None else u_variance / 100.0,
        )
    if output is not None:
        write_csv_table(output, separation_plan_table(plan))
    typer.echo(separation_plan_report(plan))
