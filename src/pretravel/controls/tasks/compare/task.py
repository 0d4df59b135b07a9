"""Compare the errors after each correction of a map; or the designs of two probes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import InputError, PretravelError
from pretravel.controls.tasks.export.task import CONTROL_FORM, FormOnControl
from pretravel.task import (
    SILENT,
    Field,
    InModes,
    ModelOfMap,
    Progress,
    Reported,
    Result,
    ShownQuantity,
    existing,
    is_probe,
    output,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from pretravel.design import DesignComparison
    from pretravel.maps import PretravelMap
    from pretravel.measurement import Comparison, Correction
    from pretravel.show import Document, KeyFigure


def _controls_with_maps() -> list[str]:
    from pretravel.controls.exports import CONTROLS

    return [name for name, control in CONTROLS.usable().items() if "form" in control.options]


def _control_help() -> str:
    *names, last = _controls_with_maps()
    return (
        "Include the correction that this control makes with the files of pretravel export: "
        f"{', '.join(names)} or {last}."
    )


class Compare(Reported):
    """Compare the errors after each correction, from tip radius alone to full map; or two probes.

    The corrections are the tip radius alone, one radius (the mean around the equator), two axis
    radii, four directions, a sector table (from touches at its angles, or computed from the map),
    Woźniak's constant and the full map; --verbose explains each. The errors are those on the
    equator, in all directions and, with --part, on a part, in µm. Of two probes (MAP and PROBE),
    the predicted forces, pretravels and their contributions are compared.

    Two designs: pretravel compare omp40-2 mine.toml -o designs.html
    """

    name = "compare"
    example = "pretravel compare map.json --part part.csv -o compare.html"

    map_file: Annotated[
        str,
        Field(
            help="Map (.json or .csv), or a probe (catalogue name or .toml), whose map is "
            "predicted.",
            label="Map",
            positional=True,
            metavar="MAP",
            reads=existing,
            word=is_probe,
        ),
    ]
    other: Annotated[
        str | None,
        Field(
            help="Second probe (catalogue name or .toml), where MAP is a probe, too: the two "
            "designs are compared.",
            label="Second probe",
            positional=True,
            metavar="PROBE",
            reads=existing,
            states="two descriptions are compared, not a map",
            word=is_probe,
        ),
    ] = None
    part: Annotated[
        Path | None,
        Field(
            help="Touches, targets or compensated points of a part: compare on its normals, too. "
            "The file needs the columns nx,ny,nz (or I,J,K), and no unit. Of touches without "
            "normals, give the points that compensate writes.",
            reads=True,
            without=("other",),
        ),
    ] = None
    control: Annotated[
        str | None,
        Field(
            help=_control_help,
            option="--for",
            names=_controls_with_maps,
            metavar="CONTROL",
            label="Correction on a control",
            without=("other",),
        ),
    ] = None
    form: Annotated[FormOnControl, replace(CONTROL_FORM, only=("control",))] = None
    model: ModelOfMap = "analytic"
    quantity: Annotated[ShownQuantity, InModes(only=("other",))] = "pretravel"
    output: Annotated[
        Path | None,
        output("Table: .csv; the report: .json, or a page, .html or .pdf.", ".csv", report=True),
    ] = None

    def run(self, progress: Progress = SILENT) -> ComparedMap | ComparedProbes:
        """Read or predict the map and compare.

        Returns
        -------
        ComparedMap
            Or `ComparedProbes`, with a second probe.
        """
        from pretravel.task import map_or_prediction

        if self.other is not None:
            return self._of_probes(self.other, progress)
        with progress.working("comparing"):
            pretravel_map = map_or_prediction(self.map_file, self.model)
            normals = None if self.part is None else _normals_of(self.part)
            return self.compared(pretravel_map, normals)

    def compared(
        self, pretravel_map: PretravelMap, part_normals: npt.ArrayLike | None = None
    ) -> ComparedMap:
        """Compare corrections with a map; parameters and errors as `compare_corrections`."""
        from pretravel.measurement import compare_corrections

        others = self._on_control(pretravel_map)
        compared = compare_corrections(pretravel_map, part_normals, others)
        return ComparedMap(self, pretravel_map, compared)

    def _on_control(self, pretravel_map: PretravelMap) -> dict[str, Correction]:
        from pretravel.controls.control import ExportSettings
        from pretravel.controls.exports import correction_on_control

        if self.control is None:
            return {}
        settings = ExportSettings(form=self.form or "auto")
        name, correction = correction_on_control(pretravel_map, self.control, settings)
        return {name: correction}

    def _of_probes(self, other: str, progress: Progress) -> ComparedProbes:
        from pretravel.design import compare_designs

        names = self.map_file, other
        maps = [name for name in names if Path(name).suffix.lower() not in (".toml", "")]
        if maps:
            raise PretravelError(
                f"{maps[0]} is not the description of a probe. compare takes one map, or two "
                "probes (names of pretravel probes, or .toml)"
            )
        with progress.working("comparing"):
            return ComparedProbes(self, compare_designs(*names, self.model))


def _not_in_the_map(pretravel_map: PretravelMap) -> list[str]:
    """What a map does not contain of the errors that are compared."""
    from pretravel.controls.map_identity import unknown_size
    from pretravel.maps import is_reversal

    said, made = [], pretravel_map.provenance
    size = unknown_size(pretravel_map)
    if size or not made.level_known:
        why = size or (
            "the mean pretravel is not known: the map is about its mean, or the tip's diameter was "
            "not given"
        )
        said.append(f"{why}: the errors that the tip radius alone leaves are not known either")
    if is_reversal(made.orientation):
        said.append(
            "the map is from means at two orientations of the spindle (pretravel reversal): these "
            "are errors of such means. Single touches also have the odd lobes"
        )
    return said


def _normals_of(part: Path) -> npt.ArrayLike:
    """The normals of a file of touches, targets or points."""
    from pretravel.files import read_directions

    try:
        return read_directions(part)
    except InputError as error:
        if not part.is_file():
            raise
        raise PretravelError(
            f"{error}. Compensate these touches first (pretravel compensate {part.name}) with the "
            "kind of their feature (bore, boss, sphere), a nominal surface, a plan, or the columns "
            "of the normals. Then compare on the points that compensate writes",
            inputs=error.inputs,
        ) from None


@dataclass(frozen=True, eq=False)
class ComparedMap(Result):
    """Corrections compared with a map."""

    task: Compare
    pretravel_map: PretravelMap
    comparison: Comparison

    def document(self) -> Document:
        """The report."""
        from pretravel.controls.tasks.compare.report import comparison_document

        report = comparison_document(self.comparison, map_name=Path(self.task.map_file).name)
        said = _not_in_the_map(self.pretravel_map)
        return replace(report, warnings=(*report.warnings, *said))

    def write(self, output: str, path: Path) -> None:
        """Write the errors, a row for each correction and place."""
        del output
        from pretravel.controls.tasks.compare.report import comparison_columns
        from pretravel.files import write_csv_table

        write_csv_table(path, comparison_columns(self.comparison))

    def sentence(self) -> str:
        """What the numbers of `headline` hold for, and what stands in none of them."""
        from pretravel.controls.tasks.compare.lobes_report import lobes_sentence

        return lobes_sentence(self.comparison)

    def headline(self) -> tuple[KeyFigure, ...]:
        """The size of the lobes, and what corrections leave of them."""
        from pretravel.controls.tasks.compare.lobes_report import lobes_figures

        return lobes_figures(self.pretravel_map, self.comparison)


@dataclass(frozen=True, eq=False)
class ComparedProbes(Result):
    """Two probes and what is predicted of them."""

    task: Compare
    designs: DesignComparison

    def document(self) -> Document:
        """The report."""
        assert self.task.other is not None
        return self.designs.document(
            (Path(self.task.map_file).name, Path(self.task.other).name), self.task.quantity
        )

    def write(self, output: str, path: Path) -> None:
        """Write the predictions, a row for each direction."""
        del output
        from pretravel.design import design_comparison_columns
        from pretravel.files import write_csv_table

        write_csv_table(path, design_comparison_columns(self.designs.triggers))
