"""What ``pretravel qualify --prior`` does: an old map and a few touches make a new map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.cli.files import MAPS, PICTURES, check_files
from pretravel.cli.showing import save_picture, show
from pretravel.errors import PretravelError

if TYPE_CHECKING:
    from pretravel.maps.pretravel_map import PretravelMap


def qualify_with_prior(
    touches: Path,
    prior: Path,
    diameter: float,
    *,
    tip_diameter: float | None,
    ring: bool,
    outputs: tuple[Path | None, Path | None],
    verbose: bool,
) -> None:
    """Update an old map, write it and show what has changed.

    Parameters
    ----------
    touches, prior : Path
    diameter : float
        [mm]
    tip_diameter : float or None
        It must be that of the old map. [mm]
    ring : bool
    outputs : pair of Path or None
        Of the map or page, and of the picture.
    verbose : bool

    Raises
    ------
    PretravelError
        As `update_map`; another tip.
    """
    from pretravel.formats.map_file import read_map, write_map
    from pretravel.formats.readings import read_readings
    from pretravel.qualification.prior_update import update_map
    from pretravel.report.map_update_report import map_update_document
    from pretravel.report.page import write_page

    output, plot = outputs
    check_files([(output, MAPS), (plot, PICTURES)], [touches, prior])
    old = read_map(prior)
    _refuse_other_tip(old, tip_diameter, prior)
    readings = read_readings(touches).in_machine_axes()
    result = update_map(readings.touches, old, diameter, ring=ring)
    report = map_update_document(
        result, touches_name=touches.name, prior_name=prior.name, warnings=readings.notes()
    )
    if output is not None and output.suffix.lower() == ".html":
        write_page(output, report)
    elif output is not None:
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
