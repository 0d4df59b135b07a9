"""Qualify a probe: touches on a reference, from files, to a map and its report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import DEVIATION_OF_FORM, MICROMETRE, TIP_BALL, U_OF_DIAMETER, PretravelError
from pretravel.task import (
    MAPS,
    PAGES,
    SILENT,
    UPRIGHT,
    Diameter,
    Field,
    InModes,
    LaboratoryReport,
    Length,
    ProbeAxis,
    Progress,
    Result,
    Ring,
    TouchFilesWithFeed,
    by_name,
    output,
)
from pretravel.tasks.qualify.references import (
    TERM_ENDINGS,
    OnReferences,
    QualifiedReferences,
    fitted_references,
    on_references,
    references_of,
    size_warnings,
    without_map,
)
from pretravel.tasks.qualify.settings_of_kinds import SettingsOfKinds, kinds_where
from pretravel.tasks.qualify.several_tips import STAR, TIP_ENDINGS, OfSeveralTips, QualifiedTips

if TYPE_CHECKING:
    from pretravel.files import FileReadings, LaboratoryStatements
    from pretravel.maps import PretravelMap, QualificationSetup, SetupOptions
    from pretravel.qualification import MapUpdate, Qualification
    from pretravel.show import Document


def kind_names() -> Iterator[str]:
    """The kinds of map, and the choice among them."""
    from pretravel.maps import AUTO, KINDS

    yield from KINDS
    yield AUTO


def _kind_help() -> str:
    """The kinds of map with a few words for each."""
    from pretravel.maps import KINDS

    own = (f"{name} ({kind.summary})" for name, kind in KINDS.usable().items())
    return (
        f"Kind of map, one of {', '.join(kind_names())}: auto is the average of the kinds that "
        f"predict left-out directions; {', '.join(own)}."
    )


def _kind_words() -> dict[str, str]:
    """What a form calls the kinds of map."""
    from pretravel.maps import AUTO, KINDS

    own = {name: f"{name.capitalize()}: {one.summary}" for name, one in KINDS.usable().items()}
    return {AUTO: "Automatic (best for left-out touches)", **own}


class Qualify(OfSeveralTips, TouchFilesWithFeed, LaboratoryReport, OnReferences, SettingsOfKinds):
    """Qualify a probe on a reference sphere or ring: centre, radius, map, uncertainty.

    Touches at two or more feeds (column feed_mm_min) also determine the signal delay.

    Without a sphere: --block 50.8 takes touches on a gauge block or a 1-2-3 block, --pin those
    outside a pin or boss, --reference those on several references (see pretravel plan-touches
    --block).

    A shop's own table is read as it is, for example X;Y;Z;I;J;K with decimal commas:
    pretravel qualify shop.csv --units inch --diameter 25.4 --tip-diameter 6 -o map.json
    """

    name = "qualify"
    example = "pretravel qualify sphere.csv --diameter 25 --tip-diameter 6 -o map.json"

    diameter: Annotated[
        Diameter | None, InModes(without=("block", "reference", "unknown_size"))
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the tip, in mm. Without it, the mean of the map is zero and heights "
            "are less certain, usually by 5 to 15 µm.",
            range=TIP_BALL,
            label="Diameter of the tip",
            hint="Of the stylus ball, for example 6",
            without=(STAR,),
        ),
    ] = None
    kind: Annotated[
        str,
        Field(
            help=_kind_help,
            names=kind_names,
            metavar="KIND",
            label="Kind of map",
            words=_kind_words,
            without=("prior", "block", "reference"),
        ),
    ] = "auto"
    ring: Annotated[Ring, InModes(without=("block", "reference", STAR))] = False
    u_diameter_um: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the diameter, in µm; default: 0.2, assumed; U of the "
            "certificate divided by its k.",
            range=U_OF_DIAMETER,
            label="Standard uncertainty of the diameter",
            hint="Half of U (k = 2) on the certificate; 0.2 µm is assumed where it is empty",
            without=("prior", "unknown_size"),
        ),
    ] = None
    u_temperature: Annotated[
        float,
        Field(
            help="Standard uncertainty of the reference's temperature, in K.",
            range=(0.0, 50.0),
            unit="K",
            label="Standard uncertainty of its temperature",
            without=("prior",),
        ),
    ] = 0.2
    sphere_form_um: Annotated[
        float,
        Field(
            help="Form deviation of the reference, highest to lowest point, in µm; default: that "
            "of a grade 5 ball (0.13).",
            range=DEVIATION_OF_FORM,
            label="Form deviation of the reference",
            without=("prior",),
        ),
    ] = 0.13
    axial_pretravel_um: Annotated[
        Length,
        Field(
            help="Assumed pretravel along the probe axis, in µm, which touches on a sphere do not "
            "determine; none: use the least-squares centre.",
            only=(kinds_where(lambda kind: kind.takes_axial_pretravel),),
            without=("prior", "ring", "pin"),
            metavar="UM",
            label="Pretravel along the probe's axis, assumed",
            hint="For kind harmonic: touches on a sphere do not determine it",
        ),
    ] = Length(1.0)
    axis: Annotated[ProbeAxis, InModes(without=("prior", "block", "reference", STAR))] = UPRIGHT
    prior: Annotated[
        Path | None,
        Field(
            help="Old map of this probe (.json), which a few new touches bring up to date. They "
            "need 5 or more directions (see pretravel plan-touches). Kind, axis and conventions "
            "stay as in the old map.",
            reads=True,
            states="the old map gives it",
            without=("block", "reference", STAR, "unknown_size"),
        ),
    ] = None
    output: Annotated[
        Path | None,
        output("Map: .json, or a .csv table; or a page, .html or .pdf.", *MAPS, *PAGES),
    ] = None

    def endings(self, output: str) -> tuple[str, ...]:
        """On blocks and several references a table or a page, and no map."""
        if output == "output" and (self.on_references or self.star):
            return TIP_ENDINGS if self.star else TERM_ENDINGS
        return super().endings(output)

    def run(
        self, progress: Progress = SILENT
    ) -> QualifiedProbe | UpdatedProbe | QualifiedReferences | QualifiedTips:
        """Read the touches and determine the map.

        Returns
        -------
        QualifiedProbe
            Or `UpdatedProbe`, with an old map; `QualifiedReferences`, on blocks or several.
        """
        if self.on_references:
            return self._on_references(progress)
        if self.star:
            return self._of_several_tips(progress)
        if self.prior is not None:
            return self._update(self.prior, progress)
        readings = self.read(progress)
        with progress.working(f"qualifying on {len(readings.touches)} touches"):
            return self.qualified(readings)

    def read(self, progress: Progress = SILENT) -> FileReadings:
        """The touches, in the axes of the machine."""
        readings = self.read_touches(
            progress,
            tip_diameter=self.tip_diameter,
            reference_diameter=self.reference_diameter(),
            ring=self.in_plane,
        ).in_machine_axes()
        return self._as_round(readings) if self.in_plane else readings

    def _as_round(self, readings: FileReadings) -> FileReadings:
        """Touches on a pin as those in a ring, and heights as if the axis were upright."""
        from pretravel.qualification import (
            as_upright_ring,
            unknown_diameter,
            without_tilt,
        )

        diameter = self.reference_diameter()
        if self.pin and diameter is None:
            # The circle is that of the pin: outside, the tip is added.
            upright = without_tilt(readings.touches, ring=False)
            found = unknown_diameter(upright, 0.0, ring=True)
            diameter = found - (self.tip_diameter or 0.0)
        touches = as_upright_ring(readings.touches, diameter or 0.0, pin=self.pin)
        return replace(readings, touches=touches)

    @property
    def in_plane(self) -> bool:
        """Whether the touches are around an upright ring, bore, pin or boss."""
        return self.ring or self.pin

    def reference_diameter(self) -> float | None:
        """The diameter that is stated; None where it is stated that it is not known.

        Raises
        ------
        PretravelError
            Neither.
        """
        if self.diameter is None and not self.unknown_size:
            raise PretravelError(
                "the diameter of the reference is not given. For a block, give the distances of "
                "its faces; for a reference of unknown size, say so (only the shape of the map "
                "is then determined)",
                inputs=("diameter", "block", "unknown_size"),
            )
        return self.diameter

    def qualified(self, readings: FileReadings) -> QualifiedProbe:
        """Qualify on touches that have been read.

        Parameters
        ----------
        readings : FileReadings
            In the axes of the machine.
        """
        from pretravel.maps import AUTO, KINDS
        from pretravel.qualification import qualified
        from pretravel.touches import EACH_ROW

        names = list(KINDS) if self.kind == AUTO else [self.kind]
        wished = [self.kind_of_map(name) for name in names]
        setup = self.setup(readings)
        found = qualified(readings.touches, setup, wished if self.kind == AUTO else wished[0])
        if found.copies:  # says it with their number
            said = tuple(said for said in readings.warnings if not said.startswith(EACH_ROW))
            readings = replace(readings, warnings=said)
        return QualifiedProbe(self, readings, found)

    def _on_references(self, progress: Progress) -> QualifiedReferences:
        """On blocks or several references, of which a round one gives the map."""
        form = self.sphere_form_um * MICROMETRE
        own = [text.count(":") > 1 or text.endswith("unknown") for text in self.reference]
        if self.u_diameter_um is not None and self.block is None and all(own):
            raise PretravelError(
                "u of the diameter is not used: each reference gives its own, or has no known "
                "size; leave it out",
                inputs=("u_diameter", "reference"),
            )
        references = references_of(
            self,
            u_usual=(0.2 if self.u_diameter_um is None else self.u_diameter_um) * MICROMETRE,
            u_temperature=self.u_temperature,
            form=form if self.stated("sphere_form_um") else None,
        )
        if self.stated("axial_pretravel_um") and not any(
            one.shape == "sphere" for one in references
        ):
            raise PretravelError(
                "the pretravel along the axis is assumed on a sphere, and there is none: leave it "
                "out",
                inputs=("axial_pretravel",),
            )
        options = self.reading_options(tip_diameter=self.tip_diameter, exclude=self.exclude)
        options = on_references(options, references)
        readings = self.read_with(options, progress).in_machine_axes()
        setup: SetupOptions = {
            "tip_diameter": self.tip_diameter,
            "sphere_form": form,
            "axial_pretravel": self.axial_pretravel_um.millimetres,
        }
        fit, made = fitted_references(self, readings.touches, references, setup, progress)
        if made is None and self.output is not None and self.output.suffix.lower() == ".json":
            raise without_map(self.output)
        name = self.touches_name
        return QualifiedReferences(self, name, readings, tuple(references), fit, made)

    def _of_several_tips(self, progress: Progress) -> QualifiedTips:
        """Each tip on its touches of the sphere."""
        from pretravel.maps import AUTO
        from pretravel.measurement import rows_of_tips, star_stylus
        from pretravel.qualification import qualified

        parts = [one.parts for one in self.star]
        readings = self.read(progress)
        rows = rows_of_tips(readings.touches, [one.name for one in parts])
        name = "harmonic" if self.kind == AUTO else self.kind
        kind = replace(self, kind=name).kind_of_map(name)
        made: dict[str, Qualification] = {}
        for one in parts:
            if one.name not in rows:
                raise PretravelError(f"no touch was made with the tip {one.name}", inputs=("tip",))
            with progress.working(f"qualifying the tip {one.name}"):
                own = replace(self, tip=(), tip_diameter=one.diameter, axis=one.axis, output=None)
                made[one.name] = qualified(readings.touches.take(rows[one.name]), own.setup(), kind)
        with progress.working("offsets of the tips"):
            return QualifiedTips(self, self.touches_name, readings, made, star_stylus(made))

    def setup(self, readings: FileReadings | None = None) -> QualificationSetup:
        """Reference, tip and conventions."""
        from pretravel.maps import QualificationSetup

        axial = self.axial_pretravel_um.millimetres
        if axial is not None and self.tip_diameter is None and self.stated("axial_pretravel_um"):
            raise PretravelError(
                "without the tip's diameter the centre is that of the least-squares sphere, and an "
                "assumed pretravel along the axis is not used: give the tip's diameter, or leave "
                "it out",
                inputs=("axial_pretravel", "tip_diameter"),
            )
        diameter, u_diameter = self.reference_diameter(), self.u_diameter_um
        u = None if u_diameter is None else u_diameter * MICROMETRE
        if diameter is None:
            from pretravel.qualification import U_UNKNOWN_SIZE, unknown_diameter

            assert readings is not None  # a size that is not known is that of the touches
            tip = self.tip_diameter or 0.0
            diameter = unknown_diameter(readings.touches, tip, ring=self.in_plane)
            u = U_UNKNOWN_SIZE
        return QualificationSetup(
            diameter,
            tip_diameter=self.tip_diameter,
            ring=self.in_plane,
            u_diameter=u,
            u_temperature=self.u_temperature,
            sphere_form=self.sphere_form_um * MICROMETRE,
            axial_pretravel=axial,
            axis=self.axis,
        )

    def _update(self, prior: Path, progress: Progress) -> UpdatedProbe:
        from pretravel.files import read_map
        from pretravel.qualification import update_map

        old = read_map(prior)
        _refuse_other_tip(old, self.tip_diameter, prior)
        diameter = self.reference_diameter()
        assert diameter is not None  # without an old map alone it can be unknown
        if self.pin and old.machine is not None:
            raise PretravelError(
                f"{prior} contains terms of the machine, which are subtracted from touches on a "
                "sphere or in a ring, not on a pin: touch one of these, or qualify again",
                inputs=("pin", "prior"),
            )
        tip = self.tip_diameter
        if tip is None and old.provenance.level_known:
            tip = 2.0 * old.tip_radius  # with it the files' own is compared
        readings = replace(self, tip_diameter=tip).read(progress)
        result = update_map(readings.touches, old, diameter, ring=self.in_plane)
        return UpdatedProbe(self, readings, result)


class _MapResult(Result):
    """What both ways have in common: a map with a report."""

    task: Qualify
    readings: FileReadings

    @property
    def pretravel_map(self) -> PretravelMap:
        """The map of the probe."""
        raise NotImplementedError

    def statements(self) -> LaboratoryStatements | None:
        """What the laboratory states, compared also with the files' feed and the map's tip."""
        feeds, made = self.readings.touches.feeds, self.pretravel_map
        feed = float(feeds[0]) if feeds is not None and len({*feeds.tolist()}) == 1 else None
        tip = 2.0 * made.tip_radius if made.provenance.level_known else None
        return self.task.statements(feed=feed, tip_diameter=tip)

    def write(self, output: str, path: Path) -> None:
        """Write the map."""
        del output
        from pretravel.files import write_map

        write_map(path, self.pretravel_map)


@dataclass(frozen=True, eq=False)
class QualifiedProbe(_MapResult):
    """A qualification with the touches that it is of."""

    task: Qualify
    readings: FileReadings
    qualification: Qualification

    @property
    def pretravel_map(self) -> PretravelMap:
        """The map of the probe."""
        return self.qualification.pretravel_map

    def in_brief(self, report: Document) -> Document:
        """With the options that state what was assumed."""
        from pretravel.tasks.qualify.report import assumptions

        brief = super().in_brief(report)
        remark = f"to give yours: {' '.join(assumptions(self.qualification))}"
        figures = (
            replace(each, remark=remark) if each.name == "assumed" else each
            for each in brief.figures
        )
        return replace(brief, figures=tuple(figures))

    def document(self) -> Document:
        """The report, with what the laboratory states."""
        from pretravel.task import with_laboratory
        from pretravel.tasks.qualify.report import qualification_document

        task, path = self.task, self.task.output
        report = qualification_document(
            self.qualification,
            touches_name=task.touches_name,
            scores=self.qualification.scores,
            warnings=[*self.readings.notes(), *task.statement_warnings(), *size_warnings(task)],
            excluded=_left_out(task.exclude, self.readings),
            saved=path is not None and not by_name(Qualify)["output"].is_report(path),
        )
        return with_laboratory(report, self.statements())


@dataclass(frozen=True, eq=False)
class UpdatedProbe(_MapResult):
    """An old map that a few touches brought up to date."""

    task: Qualify
    readings: FileReadings
    update: MapUpdate

    @property
    def pretravel_map(self) -> PretravelMap:
        """The new map."""
        return self.update.pretravel_map

    def document(self) -> Document:
        """The report: what has changed; with what the laboratory states."""
        from pretravel.task import with_laboratory
        from pretravel.tasks.qualify.update_report import map_update_document

        task = self.task
        assert task.prior is not None
        report = map_update_document(
            self.update,
            touches_name=self.readings.touches.source or "",
            prior_name=task.prior.name,
            warnings=[*self.readings.notes(), *task.statement_warnings()],
        )
        return with_laboratory(report, self.statements())


def _left_out(exclude: Sequence[str], readings: FileReadings) -> list[str]:
    """What was excluded; in a file without labels a number is a line, not a running number."""
    labelled = readings.touches.labels is not None
    return [f"line {name}" if name.isdecimal() and not labelled else name for name in exclude]


def _refuse_other_tip(old: PretravelMap, tip_diameter: float | None, prior: Path) -> None:
    if tip_diameter is None or not old.provenance.level_known:
        return
    if abs(tip_diameter - 2.0 * old.tip_radius) > 1e-6:
        raise PretravelError(
            f"{prior} is the map of a tip of {2.0 * old.tip_radius:.6g} mm diameter, not of "
            f"{tip_diameter:.6g} mm: after a change of the stylus qualify without it",
            inputs=("tip_diameter", "prior"),
        )
