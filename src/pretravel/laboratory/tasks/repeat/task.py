"""What any log of touches of one point says: noise, drift, first touch, the next touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import MICROMETRE
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    FileFormatName,
    Progress,
    Reported,
    Result,
    Series,
    StatedColumns,
    Units,
    files_meant,
    output,
)

if TYPE_CHECKING:
    from pretravel.laboratory.repeat_log import RepeatLog
    from pretravel.laboratory.repeat_series import RepeatSeries
    from pretravel.show import Document


class Repeat(Reported):
    """Evaluate repeated touches of one point: noise, drift, error of the first touch.

    It also gives the interval in which the next touch will lie.
    """

    name = "repeat"
    example = "pretravel repeat octoprint.log --plot repeat.png"

    log: Annotated[
        tuple[Path, ...],
        Field(
            help="Log of repeated touches by any probe; no reference is needed: Klipper, Marlin, "
            "RepRapFirmware, grbl, LinuxCNC, any format that pretravel formats lists; or a table "
            "of x, y, z, or of "
            "heights alone.",
            positional=True,
            metavar="LOG",
            reads=files_meant,
        ),
    ]
    units: Annotated[
        Units | None,
        Field(
            help="Unit of length of a file that does not give it.",
            label="Unit of the touches",
            words={"": "as the file shows it"},
        ),
    ] = None
    axis: Annotated[
        Literal["x", "y", "z"] | None,
        Field(
            help="Axis along which the touches went; found where the file does not give it.",
            words={"": "found from the positions"},
        ),
    ] = None
    step_um: Annotated[
        float | None,
        Field(
            help="Step of the positions, in µm, such as that of a motor or a scale; it is looked "
            "for if it is not given.",
            range=(0.0, 1000.0),
            label="Step of the positions",
        ),
    ] = None
    file_format: FileFormatName = None
    series: Series = ()
    columns: Annotated[
        StatedColumns | None,
        Field(
            help="Columns of a table by name or number, for x,y,z.",
            metavar="x=X,y=Y,z=Z",
        ),
    ] = None
    output: Annotated[
        Path | None,
        output(
            "Each touch with the fitted level and the residual: .csv; or a page, .html or .pdf.",
            ".csv",
            *PAGES,
        ),
    ] = None

    def run(self, progress: Progress = SILENT) -> JudgedLogs:
        """Read the logs and judge each series."""
        from pretravel.files import ReadingOptions
        from pretravel.laboratory.repeat_log import read_repeats
        from pretravel.laboratory.repeat_series import judged_repeats, step_of_repeats

        options = ReadingOptions(units=self.units, columns=self.columns, series=self.series)
        files = files_meant(self.log)
        logs = [
            (path.name, read_repeats(path, options, self.axis, file_format=self.file_format))
            for path in files
        ]
        series = []
        for name, log in logs:
            step = (self.step_um or 0.0) * MICROMETRE
            step = step or step_of_repeats([one.values for one in log.series])
            for one in log.series:
                words = [name] if len(logs) > 1 else []
                words += [one.name] if one.name and len(log.series) > 1 else []
                with progress.working(f"{len(one.values)} touches"):
                    judged = judged_repeats(one.values, step=step)
                series.append(JudgedSeries(", ".join(words), judged, one.lines.tolist()))
        title = files[0].name if len(files) == 1 else f"{files[0].name} … {files[-1].name}"
        return JudgedLogs(title, tuple(series), tuple(log for _, log in logs))


@dataclass(frozen=True, eq=False)
class JudgedSeries:
    """One series of touches and what it says.

    Attributes
    ----------
    name : str
        Empty where there is only one.
    judged : RepeatSeries
    lines : sequence of int
        Line of the file of each touch.
    """

    name: str
    judged: RepeatSeries
    lines: Sequence[int]


@dataclass(frozen=True, eq=False)
class JudgedLogs(Result):
    """What the logs say."""

    title: str
    series: tuple[JudgedSeries, ...]
    logs: tuple[RepeatLog, ...]

    def document(self) -> Document:
        """The report."""
        from pretravel.laboratory.tasks.repeat.report import repeat_document

        warnings = [warning for log in self.logs for warning in log.warnings]
        single = sum(log.single for log in self.logs)
        return repeat_document(
            self.title,
            [(one.name, one.judged, one.lines) for one in self.series],
            single=single,
            along=self.logs[0].along,
            warnings=tuple(dict.fromkeys(warnings)),
        )

    def write(self, output: str, path: Path) -> None:
        """Write every touch and its parts."""
        del output
        from pretravel.files import write_csv_table
        from pretravel.laboratory.tasks.repeat.report import repeat_columns

        write_csv_table(path, repeat_columns([(s.name, s.judged, s.lines) for s in self.series]))
