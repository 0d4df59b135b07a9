"""What ``pretravel qualify --prior`` does: an old map and a few touches make a new map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.base.errors import PretravelError
from pretravel.cli.files import MAPS, PICTURES, check_files, is_page
from pretravel.cli.laboratory_option import laboratory_statements, statements_left_out
from pretravel.cli.showing import save_page, save_picture, show
from pretravel.cli.touch_files import read_and_show, with_reading

if TYPE_CHECKING:
    from pretravel.files.file_format import ReadingOptions
    from pretravel.maps.pretravel_map import PretravelMap


def qualify_with_prior(
    files: list[Path],
    options: ReadingOptions,
    prior: Path,
    *,
    feed: float | None,
    tip_diameter: float | None,
    plan: Path | None,
    lab: Path | None,
    outputs: tuple[Path | None, Path | None],
    verbose: bool,
) -> None:
    """Update an old map, write it and show what has changed.

    Parameters
    ----------
    files : list of Path
    options : ReadingOptions
        With the diameter of the reference.
    prior : Path
    feed : float or None
        Of all touches, where the files state none. [mm/min]
    tip_diameter : float or None
        It must be that of the old map. [mm]
    plan : Path or None
        That the options were read from.
    lab : Path or None
        What the laboratory states.
    outputs : pair of Path or None
        Of the map or page, and of the picture.
    verbose : bool

    Raises
    ------
    PretravelError
        As `update_map`; another tip.
    """
    from pretravel.files.map_file import read_map, write_map
    from pretravel.qualification.prior_update import update_map
    from pretravel.tasks.reports.laboratory_report import with_laboratory
    from pretravel.tasks.reports.map_update_report import map_update_document

    output, plot = outputs
    check_files([(output, MAPS), (plot, PICTURES)], [*files, prior, plan, lab])
    statements = laboratory_statements(lab)
    old = read_map(prior)
    _refuse_other_tip(old, tip_diameter, prior)
    assert options.reference_diameter is not None
    readings = read_and_show(files, options, feed=feed).in_machine_axes()
    result = update_map(readings.touches, old, options.reference_diameter, ring=options.ring)
    report = map_update_document(
        result,
        touches_name=readings.touches.source or "",
        prior_name=prior.name,
        warnings=readings.notes() + statements_left_out(lab, output, verbose=verbose),
    )
    report = with_laboratory(report, statements)
    save_page(with_reading(report, readings), output)
    if output is not None and not is_page(output):
        write_map(output, result.pretravel_map)
    save_picture(report, plot)
    show(report, verbose=verbose)


def _refuse_other_tip(old: PretravelMap, tip_diameter: float | None, prior: Path) -> None:
    if tip_diameter is None or not old.provenance.level_known:
        return
    if abs(tip_diameter - 2.0 * old.tip_radius) > 1e-6:
        raise PretravelError(
            f"{prior} is the map of a tip of {2.0 * old.tip_radius:.6g} mm diameter, not of "
            f"{tip_diameter:.6g} mm: after a change of the stylus qualify without it",
            inputs=("tip_diameter", "prior"),
        )
