"""Demonstrate pretravel: the main job on example data, its files and a page."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import PretravelError, refuse_other_kinds
from pretravel.task import FOLDER, SILENT, Field, Progress, Result, Task, Verbose

if TYPE_CHECKING:
    from pretravel.show import Document, Picture, WorkRecord

_LOG = logging.getLogger(__name__)


class Demo(Task):
    """Run all steps on the example data: qualify, compensate, compare, write a page."""

    name = "demo"
    example = "pretravel demo -o demo-output"

    data: Annotated[
        Path | None,
        Field(
            help="Folder of sphere_touches.csv, bore_touches.csv, part_touches.csv and "
            "kp3_ring.csv; the default is the example data of the package.",
            metavar="FOLDER",
        ),
    ] = None
    output: Annotated[
        Path,
        Field(
            help="Folder for the points, the pictures and the page.",
            short="-o",
            writes=FOLDER,
            in_run=True,
        ),
    ] = Path("demo-output")
    verbose: Verbose = False

    def further_files(self) -> list[Path]:
        """The files of the example data."""
        from pretravel.demo.demonstration import DATA_FILES

        return [self.folder / name for name in DATA_FILES]

    @property
    def folder(self) -> Path:
        """The folder of the example data."""
        from pretravel.task import example_folder

        return self.data or example_folder()

    def run(self, progress: Progress = SILENT) -> Demonstration:
        """Do the main job, and write map, points, pictures and a page.

        Each file is written as soon as what it shows is known.

        Raises
        ------
        PretravelError
            Data that are missing or wrong; a folder that cannot be made, or has other files.
        """
        from pretravel.demo.demonstration_report import DEMONSTRATION_FILES

        refuse_other_kinds(self.output / name for name in DEMONSTRATION_FILES)
        record = progress.record()
        with progress.working("qualifying, compensating, drawing"):
            return Demonstration(self, self._written(record, progress.say))

    def _written(self, record: WorkRecord | None, say: Callable[[str], None]) -> Document:
        """Write the page and its files; return what is printed."""
        from pretravel.demo.demonstration import (
            compare_kinds_of_map,
            do_main_job,
            read_demonstration,
        )
        from pretravel.demo.demonstration_report import (
            demonstration_document,
            demonstration_summary,
            kinds_pictures,
            main_job_pictures,
        )
        from pretravel.files import write_map, write_points
        from pretravel.show import write_page

        touches, folder = read_demonstration(self.folder), self.output
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise PretravelError(f"cannot make the folder {folder}: {error.strerror}") from error
        say("1 of 4: qualifying the probe, measuring two bores, compensating a part")
        job = do_main_job(touches)
        say("2 of 4: drawing their pictures")
        pictures = main_job_pictures(job)
        _write_pictures(pictures, folder)
        write_points(folder / "part_points.csv", job.points)
        write_map(folder / "map.json", job.qualification.pretravel_map)
        say("3 of 4: comparing the kinds of map")
        kinds = compare_kinds_of_map(touches, job.qualification)
        more = kinds_pictures(kinds)
        _write_pictures(more, folder)
        pictures |= more
        say("4 of 4: writing the page")
        document = demonstration_document(job, kinds, pictures.values())
        files = ("part_points.csv", "map.json", *pictures)
        write_page(folder / "index.html", document, files, record=record)
        return demonstration_summary(job, kinds)


@dataclass(frozen=True, eq=False)
class Demonstration(Result):
    """A demonstration, whose files have been written.

    Attributes
    ----------
    task : Demo
    summary : Document
        In some lines; the page has the rest.
    """

    task: Demo
    summary: Document

    @property
    def advice(self) -> str:
        """Where the page is."""
        return (
            f"\nLook at {(self.task.output / 'index.html').resolve()}\n"
            "(map.json, part_points.csv and the pictures are next to it; $EXAMPLES, the folder of "
            f"the example data, is {self.task.folder.resolve()})"
        )

    def document(self) -> Document:
        """The report."""
        return self.summary


def _write_pictures(pictures: Mapping[str, Picture], folder: Path) -> None:

    for name, picture in pictures.items():
        _LOG.info("%s", name)
        picture.save(folder / name)
