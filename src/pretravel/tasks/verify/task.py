"""Verify a probe: touches on a reference against its map, and its history."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import PretravelError, StaleTouchesError
from pretravel.task import (
    ANSWER,
    MAPS,
    PAGES,
    SILENT,
    Diameter,
    Field,
    OfOneTip,
    Progress,
    QualifiedMap,
    Reported,
    Result,
    Ring,
    TouchFilesWithFeed,
    output,
)

if TYPE_CHECKING:
    from pretravel.base import FloatArray
    from pretravel.files import Entry, FileReadings
    from pretravel.maps import PretravelMap
    from pretravel.qualification import Qualification, Verification
    from pretravel.show import Document
    from pretravel.touches import Touches

_COMPLETE_MAPS = tuple(ending for ending in MAPS if ending != ".csv")
"""A table does not contain all that a verification needs."""


class Verify(TouchFilesWithFeed, OfOneTip, Reported):
    """Test whether a probe has changed since its qualification. Exit code 0: no; 3: yes.

    The exit code is also 3 if the touches are in directions that cannot show a turn of the probe,
    or if nothing could be tested: the probing program did not run to its end, the map was made from
    these touches, or the history already contains them.

    The old map is kept unless --accept names a new one.
    """

    name = "verify"
    example = "pretravel verify today.csv --map map.json --diameter 24.9987 --history probe.jsonl"

    map_file: QualifiedMap
    diameter: Diameter
    ring: Ring = False
    false_alarms: Annotated[
        float,
        Field(
            help="Accepted false alarms: percentage of unchanged probes reported as changed.",
            range=(0.0001, 49.9),
            unit="%",
        ),
    ] = 1.0
    history: Annotated[
        Path | None,
        Field(
            help="History file of this probe, .jsonl; created when it does not exist.",
            reads=True,
            grows=".jsonl",
        ),
    ] = None
    accept: Annotated[
        Path | None,
        Field(
            help="Make a new map from these touches alone (.json); 25 directions or more are good. "
            "With few touches, update the old map instead: pretravel qualify --prior OLD_MAP.",
            writes=_COMPLETE_MAPS,
            in_run=True,
        ),
    ] = None
    output: Annotated[
        Path | None,
        output("Report: .json, or a page, .html or .pdf.", ".json", *PAGES, report_json=True),
    ] = None

    def run(self, progress: Progress = SILENT) -> VerifiedProbe:
        """Read the touches and the map, test, and note the result in the history.

        Returns
        -------
        VerifiedProbe
            The new map, where one is asked for, has been written with its entry in the history.

        Raises
        ------
        StaleTouchesError
            The log is that of a run that was stopped, touches are missing, the map was made from
            these touches, or the history has them already.
        """
        from pretravel.files import (
            HISTORY_ENDING,
            add_verification,
            before_those_of_map,
            read_history,
            read_map,
            time_of_touches,
        )
        from pretravel.qualification import refuse_own_touches, verify

        if self.history is not None and self.history.suffix.lower() != HISTORY_ENDING:
            raise PretravelError(
                f"{self.history} cannot be a history: the ending must be {HISTORY_ENDING}",
                inputs=("history",),
            )
        old_map = read_map(self.map_file)
        readings = self.read_touches(
            progress,
            tip_diameter=2.0 * old_map.tip_radius,
            reference_diameter=self.diameter,
            ring=self.ring,
        ).in_machine_axes()
        measured = readings.touches
        if readings.unfinished:
            raise StaleTouchesError(
                f"{self.touches_name}: {readings.unfinished}. The probe is not verified: remove "
                "the cause, and touch the reference again"
            )
        refuse_own_touches(measured, old_map)
        said = (*before_those_of_map(measured, old_map), *self._known_to_history(readings, old_map))
        readings = replace(readings, warnings=(*readings.warnings, *said))
        rate = 0.01 * self.false_alarms
        result = verify(measured, old_map, self.diameter, ring=self.ring, false_alarm_rate=rate)
        accepted = None
        if self.accept is not None:
            from pretravel.qualification import qualify_like

            accepted = qualify_like(measured, old_map, self.diameter, ring=self.ring)
        with _new_map(self.accept, None if accepted is None else accepted.pretravel_map):
            if self.history is not None:
                moment, why = time_of_touches(self.files)
                readings = replace(readings, warnings=(*readings.warnings, *filter(None, [why])))
                add_verification(
                    self.history,
                    result,
                    pretravel_map=old_map,
                    map_name=self.map_file.name,
                    touches_name=self.touches_name,
                    decision=self.decision,
                    time=moment,
                )
        unseen = result.unseen_turn is not None or result.size_is_unseen
        unsure = result.changed or unseen
        entries = () if self.history is None else tuple(read_history(self.history))
        code, moved = ANSWER if unsure else 0, _center_moved(measured, old_map, ring=self.ring)
        return VerifiedProbe(self, readings, result, entries, code, moved, accepted)

    def _known_to_history(self, readings: FileReadings, old_map: PretravelMap) -> tuple[str, ...]:
        """Refuse touches that the history has; what it says of the map."""
        from pretravel.files import (
            check_history,
            refuse_known_touches,
            replaced_since,
        )

        if self.history is None:
            return ()
        check_history(self.history, old_map)
        again = self.accept is not None
        digests = readings.digests
        refuse_known_touches(self.history, readings.touches, again_at_once=again, of_files=digests)
        return replaced_since(self.history, old_map)

    @property
    def decision(self) -> str:
        """What is done with the map."""
        return "kept" if self.accept is None else f"accepted {self.accept.name}"


@dataclass(frozen=True, eq=False)
class VerifiedProbe(Result):
    """A verification with the touches that it is of.

    Attributes
    ----------
    task : Verify
    readings : FileReadings
    verification : Verification
    entries : tuple of Entry
        The history of the probe.
    exit_code : int
        `ANSWER` where the probe has changed, or a turn of it could not be seen.
    center_moved : (3,) float, optional
        Shift of the centre of the reference since the qualification. [mm]
    accepted : Qualification, optional
        With the new map.
    """

    task: Verify
    readings: FileReadings
    verification: Verification
    entries: tuple[Entry, ...] = ()
    exit_code: int = 0
    center_moved: FloatArray | None = None
    accepted: Qualification | None = None

    def document(self) -> Document:
        """The report."""
        from pretravel.tasks.verify.report import verification_document

        task = self.task
        return verification_document(
            self.verification,
            task.decision,
            title=f"{task.touches_name} against {task.map_file.name}",
            entries=self.entries,
            warnings=self.readings.notes(),
            center_moved=self.center_moved,
            accepted=self.accepted,
        )


_FAR = 5.0
"""Standard uncertainties of a shift of the centre that is said."""


def _center_moved(
    touches: Touches, pretravel_map: PretravelMap, *, ring: bool
) -> FloatArray | None:
    """Shift of a sphere's centre since the qualification, where map and touches show it. [mm]"""
    import numpy as np

    from pretravel.measurement import apply
    from pretravel.uncertainty import fit_sphere

    before = pretravel_map.provenance.center
    if before is None or ring:
        return None
    try:
        points = apply(touches, pretravel_map, extrapolate=True, shared=False)
        found = fit_sphere(points.positions)
    except PretravelError:  # too few touches, or all in one plane
        return None
    moved = np.asarray(found.center - before)
    worst = float(np.linalg.eigvalsh(found.cofactor[:3, :3])[-1])
    u_center = float(np.max(points.standard_uncertainty)) * worst**0.5
    return moved if float(np.linalg.norm(moved)) > _FAR * u_center else None


@contextmanager
def _new_map(path: Path | None, pretravel_map: PretravelMap | None) -> Iterator[None]:
    """Write the new map when what is done within succeeds: the map and its entry, or neither."""
    from pretravel.base import whole_file
    from pretravel.files import write_map

    if path is None or pretravel_map is None:
        yield
        return
    with whole_file(path) as temporary:
        write_map(temporary, pretravel_map)
        yield
