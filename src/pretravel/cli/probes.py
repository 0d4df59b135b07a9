from __future__ import annotations

from typing import Annotated

import typer


def probes(
    name: Annotated[
        str | None, typer.Argument(help="A catalogue probe; prints its description to edit.")
    ] = None,
) -> None:
    """List the catalogue of probes, or print one description as TOML.

    Example: pretravel probes omp40-2 > mine.toml
    """
    from pretravel.probe.catalogue import catalogue_names, description_text, load_probe
    from pretravel.report import table

    if name is not None:
        typer.echo(description_text(name), nl=False)
        return
    rows = []
    for entry in catalogue_names():
        probe = load_probe(entry)
        rows.append(
            [
                entry,
                f"{probe.preload:g}",
                f"{probe.lever:g}",
                f"{probe.stylus_length:g}",
                f"{2.0 * probe.tip.radius:g}",
                probe.stem.material.name,
            ]
        )
    typer.echo(
        table(["name", "preload/N", "lever/mm", "stylus/mm", "tip/mm", "stem"], rows)
        + "\n\npretravel probes NAME > mine.toml prints a description to edit."
    )
