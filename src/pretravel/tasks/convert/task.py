"""Convert files of touches, show how they are understood, and list the formats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import DISTANCE, TIP_BALL, InputError, PretravelError
from pretravel.task import (
    PAGES,
    SILENT,
    FeedOfTouches,
    Field,
    InModes,
    OfOneTip,
    Progress,
    Result,
    Task,
    TextResult,
    TouchFilesWithFeed,
    Vector,
    When,
    by_name,
    output,
)

if TYPE_CHECKING:
    from pretravel.files import (
        FeatureResult,
        FileFormat,
        FileReadings,
        Machine,
        ReadingOptions,
        SourceFile,
    )
    from pretravel.show import Document
    from pretravel.touches import Touches

_WIDTH = 80
"""Of the lines of a text. [characters]"""


def _formats() -> list[str]:
    from pretravel.files import FORMATS

    return list(FORMATS)


_OF_TOUCHES = (
    "machine", "tip_diameter", "offset", "radius_taken_off", "bores", "frame", "feed", "exclude",
    "plan", "double_touches", "normal", "series", "tip",
)  # fmt: skip
"""Settings that the results of features do not have."""


def _is_no_page(path: object) -> bool:
    return Path(str(path)).suffix.lower() not in PAGES


_WRITTEN = When("output", is_so=_is_no_page, what="an output of data")


class Convert(TouchFilesWithFeed, OfOneTip, without=dict.fromkeys(_OF_TOUCHES, ("features",))):
    """Read a table or a file of a control, CMM or CAM system, and write touches.

    Without -o it shows how the file is understood: its first rows, and what is missing.

    Positions without normals are joined with the plan by geometry: each position lies on the
    line of a target.
    """

    name = "convert"
    example = "pretravel convert probe.txt --units mm --plan plan.csv --machine mill.toml -o t.csv"

    output: Annotated[
        Path | None,
        output(
            "Touches: .csv, .parquet, .qif; for Fusion .msr, .txt; the preview as a page: .html, "
            ".pdf. Without -o the preview is printed.",
            ".csv",
            ".parquet",
            ".qif",
            ".msr",
            ".txt",
            *PAGES,
        ),
    ] = None
    machine: Annotated[
        Path | None,
        Field(
            help="Machine file (.toml, written by pretravel machine), which gives the tip diameter "
            "and the overtravel: a touch that travelled all of it is a miss.",
            reads=True,
        ),
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(help="Diameter of the tip, in mm.", range=TIP_BALL),
    ] = None
    offset: Annotated[
        Vector | None,
        Field(
            help="Origin of the work coordinates in machine coordinates, in mm, for grbl logs.",
            metavar="X,Y,Z",
        ),
    ] = None
    radius_taken_off: Annotated[
        float | None,
        Field(
            help="Tip radius that was subtracted from the points of a DMIS or PC-DMIS file or of "
            "a CMM's listing, in mm; 0: tip centres.",
            range=DISTANCE,
        ),
    ] = None
    bores: Annotated[
        tuple[str, ...],
        Field(
            help="Name of a circle, cylinder or sphere of a CMM's listing that was touched from "
            "inside; * and ? are wildcards. May be repeated. none: all were touched from outside.",
            option="--bore",
            metavar="NAME",
        ),
    ] = ()
    features: Annotated[
        bool,
        Field(
            help="Write the results of features that the file gives, not its touches.",
            only=(_WRITTEN,),
        ),
    ] = False
    feed: Annotated[FeedOfTouches, InModes(only=(_WRITTEN,))] = None
    frame: Annotated[
        Literal["work", "machine"] | None,
        Field(
            help="Axes of the touches, where the work coordinates were rotated.",
            only=(_WRITTEN,),
        ),
    ] = None

    def run(
        self, progress: Progress = SILENT
    ) -> PreviewedFiles | ConvertedFeatures | ConvertedTouches:
        """Read the files.

        Returns
        -------
        PreviewedFiles
            Without an output, or with a page.
        ConvertedFeatures
            Of a print-out without touches, or as asked for.
        ConvertedTouches

        Raises
        ------
        PretravelError
            Files that cannot be read; a page of several files; rotated work coordinates and no
            frame; features for a file that is not a table.
        """
        from pretravel.files import opened
        from pretravel.task import format_of_touches

        files = self.files
        tip, machine = self.tip_diameter, None
        if self.machine is not None:
            from pretravel.files import read_machine
            from pretravel.maps import same_tip

            machine = read_machine(self.machine)
            if tip is not None and not same_tip(tip, machine.tip_diameter):
                raise PretravelError(
                    f"{self.machine} gives a tip of {machine.tip_diameter:g} mm, and {tip:g} mm is "
                    "given: one of them is wrong",
                    inputs=("machine", "tip_diameter"),
                )
            tip = machine.tip_diameter if tip is None else tip
        options = self._options(tip, machine)
        if self.output is None or by_name(Convert)["output"].is_report(self.output):
            return self._previewed(files, options)
        file = opened(files[0])
        known = format_of_touches(file, options, file_format=self.file_format)
        if self._wants_results(known, file):
            assert known.parse_features is not None
            replace(self, features=True)  # refuses what is stated of touches
            if self.output.suffix.lower() != ".csv":
                raise PretravelError("results of features are written as a table: -o features.csv")
            return _features(known.parse_features(file, options), only=known.parse is None)
        stated = known.name if self.columns else self.file_format
        readings = self.read_with(options, progress, file_format=stated)
        radius = readings.tip_radius if tip is None else 0.5 * tip
        touches = _in_frame(readings, self.frame)
        warnings = (*_losses(touches, self.output, radius), *readings.notes())
        return ConvertedTouches(
            touches, radius, f"{len(touches)} touches ({known.name})\n", warnings
        )

    def _wants_results(self, known: FileFormat, file: SourceFile) -> bool:
        """Whether results of features are written: as asked, or since the file has no touches."""
        if self.features and known.parse_features is None:
            raise file.error(
                f"a file of format {known.name} has no results of features: only its touches "
                "can be written",
                inputs=("features",),
            )
        return known.parse_features is not None and (self.features or known.parse is None)

    def _previews_results(self, known: FileFormat, options: ReadingOptions) -> bool:
        """Whether results of features are shown: until the settings make touches of the file."""
        asks = "radius_taken_off" in known.takes and options.radius_taken_off is None
        asks |= self.features or known.parse is None
        return known.parse_features is not None and asks

    def _options(self, tip_diameter: float | None, machine: Machine | None) -> ReadingOptions:
        """What is stated about the files."""
        from pretravel.files import work_turn

        options = self.reading_options(tip_diameter=tip_diameter, exclude=self.exclude)
        work = None if machine is None else machine.work
        return replace(
            options,
            overtravel=None if machine is None else machine.overtravel,
            offset=self.offset,
            radius_taken_off=self.radius_taken_off,
            bores=None if not self.bores else tuple(n for n in self.bores if n != "none"),
            rotation=None if work is None else work_turn(work),
        )

    def _previewed(self, files: Sequence[Path], options: ReadingOptions) -> PreviewedFiles:
        """How the files are understood, and what is missing."""
        from pretravel.files import opened
        from pretravel.show import terminal_text
        from pretravel.task import format_of_touches, look_at_touches, results_document

        if self.output is not None and len(files) > 1:
            raise PretravelError(
                f"{self.output}: a page shows the preview of one file, and there are "
                f"{len(files)}: name one"
            )
        lines, documents = [], []
        for path in files:
            file = opened(path)
            known = format_of_touches(file, options, file_format=self.file_format)
            if self._previews_results(known, options):
                assert known.parse_features is not None
                results = known.parse_features(file, options)
                document = results_document(path.name, results, _lacking(file, known, options))
                documents.append(document)
                lines.append(f"{path}: format {known.name}, {known.what}")
                lines.append(terminal_text(document, verbose=False))
                chosen = "" if known.parse is None else "--features "
                lines.append(f"\nThese results as a table: add {chosen}-o features.csv")
                continue
            looked = look_at_touches(path, options, file_format=known.name)
            document = looked.document()
            documents.append(document)
            lines.append(f"{path}: format {looked.known.name}, {looked.known.what}")
            lines.append(terminal_text(document, verbose=False))
            if not looked.unit_known:
                lines.append(
                    "\nThe unit: add --units mm or --units inch, here and to the command that uses "
                    "the file"
                )
        warnings = tuple(text for document in documents for text in document.warnings)
        return PreviewedFiles(self, tuple(documents), "\n".join(lines) + "\n", warnings)


@dataclass(frozen=True, eq=False)
class PreviewedFiles(Result):
    """How files are understood.

    Attributes
    ----------
    task : Convert
    documents : tuple of Document
        The preview of each.
    text : str
        All of them.
    cautions : tuple of str
    """

    task: Convert
    documents: tuple[Document, ...]
    text: str
    cautions: tuple[str, ...] = ()

    def write(self, output: str, path: Path) -> None:
        """Write what the files contain as a table, where they lack nothing for it: for a page."""
        if path.suffix.lower() != ".csv":
            raise PretravelError("a preview is written as a table (.csv)", inputs=("output",))
        replace(self.task, output=path).run().write(output, path)

    def page(self) -> Document:
        """The preview of the one file."""
        return self.documents[0]


@dataclass(frozen=True, eq=False)
class ConvertedFeatures(Result):
    """Results of features from a print-out."""

    features: tuple[FeatureResult, ...]
    text: str

    def write(self, output: str, path: Path) -> None:
        """Write the table of features."""
        del output
        from pretravel.files import write_csv_table

        names = ["component", "feature", "quantity", "nominal", "actual", "deviation"]
        if any(f.tolerance is not None for f in self.features):
            names.append("tolerance")
        columns = {name: [getattr(f, name) for f in self.features] for name in names}
        write_csv_table(path, columns)


def _lacking(file: SourceFile, known: FileFormat, options: ReadingOptions) -> str:
    """What is missing for touches of a file whose features are shown; empty: it has none."""
    if known.parse is None:
        return ""
    try:
        known.parse(file, options)
    except InputError as error:
        asked = ", ".join(by_name(Convert)[name].option for name in error.inputs)
        return f"{str(error).removeprefix(f'{file.path}: ')} ({asked})"
    return ""


def _features(features: Sequence[FeatureResult], *, only: bool) -> ConvertedFeatures:
    """The results of features, which are all that the file contains, or not."""
    count = len(features)
    words = ": no touches to compensate" if only else ""
    return ConvertedFeatures(
        tuple(features),
        f"{count} results of features (mm, degrees){words}\n",
    )


@dataclass(frozen=True, eq=False)
class ConvertedTouches(Result):
    """Touches of files.

    Attributes
    ----------
    touches : Touches
        In the axes that were asked for.
    tip_radius : float or None
        [mm]
    text : str
    cautions : tuple of str
        What the output cannot contain, and irregularities of the files.
    """

    touches: Touches
    tip_radius: float | None
    text: str
    cautions: tuple[str, ...] = ()

    def write(self, output: str, path: Path) -> None:
        """Write the touches."""
        del output
        from pretravel.files import write_readings

        write_readings(path, self.touches, self.tip_radius)


def _in_frame(readings: FileReadings, frame: str | None) -> Touches:
    """The touches in the machine's axes, or in work coordinates."""
    import math

    if abs(readings.rotation) > 1e-9 and frame is None:
        turn = math.degrees(readings.rotation)
        raise PretravelError(
            f"the work coordinates were turned by {turn:g}°, which a table cannot express: the "
            "frame "
            "machine rotates the touches to the machine's axes (to qualify); the frame work keeps "
            f"them (then compensate with the placement 0,0,0,0,0,{turn:g})",
            inputs=("frame",),
        )
    return readings.in_machine_axes().touches if frame == "machine" else readings.touches


def _losses(touches: Touches, output: Path, tip_radius: float | None) -> list[str]:
    """A warning of what is known of the touches and the format of the output cannot contain."""
    import numpy as np

    from pretravel.files import plain_labels, written_format

    known = written_format(output)
    ending = output.suffix.lower()
    if known.keeps_approaches_and_feeds:
        if tip_radius is None:
            return []
        said = f"{ending} does not contain the tip's diameter, {2.0 * tip_radius:.6g} mm"
        return [f"{said}: give it to the commands that need it"]
    lost = []
    if np.max(np.abs(touches.approach_directions + touches.normals)) > 1e-6:
        lost.append("approaches that are not along the normal")
    if touches.feeds is not None:
        lost.append("feeds")
    if touches.spindle is not None:
        lost.append("orientations of the spindle")
    if touches.nominal_points is not None and known.name == "qif":
        lost.append("nominal points")
    lost += [f"the column {name}" for name in touches.words]
    if touches.labels is not None and plain_labels(touches.labels) != touches.labels:
        lost.append("characters of labels other than letters, digits, space, _ . -")
    if not lost:
        return []
    return [f"{ending} cannot contain {' and '.join(lost)}; the output is without them"]


class Formats(Task):
    """List the file formats, and how reading and writing of each was verified."""

    name = "formats"
    example = "pretravel formats"

    def run(self, progress: Progress = SILENT) -> TextResult:
        """The list."""
        del progress
        import textwrap

        from pretravel.files import FORMATS

        margin = 2 + max(map(len, FORMATS))
        lines = []
        for name, entry in FORMATS.items():
            lines.append(f"{name:{margin}s}{entry.what}")
            properties = {
                "read as": entry.reads,
                "written from": entry.writes,
                "needs": entry.needs,
                "verified against": entry.verified,
                "refused": entry.refusal,
            }
            for what, text in properties.items():
                wrapped = textwrap.wrap(f"{what}: {text}", _WIDTH) if text else []
                lines += [" " * margin + line for line in wrapped]
        return TextResult("\n".join(lines) + "\n")
