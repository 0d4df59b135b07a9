"""Coverage of U: a qualification, simulated many times against the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import MICROMETRE, NOISE, REFERENCE_DIAMETER, U_OF_DIAMETER, PretravelError
from pretravel.task import (
    ANSWER,
    PAGES,
    SILENT,
    Field,
    Progress,
    Result,
    Task,
    output,
)
from pretravel.tasks.qualify import Qualify

if TYPE_CHECKING:
    from pretravel.base import FloatArray
    from pretravel.drawing.tasks.check_budget.budget_check import BudgetCheck, Coverage
    from pretravel.files import FileReadings
    from pretravel.qualification import Qualification
    from pretravel.show import Document, KeyFigure, Table, View
    from pretravel.touches import Touches

_WORDS = {
    "right": "U is right: it contains the error as often as it should",
    "too small": "U is too small: it contains the error less often than it should",
    "too large": "U is larger than needed: it costs touches and good parts",
}
_LEVELS: Mapping[str, Literal["good", "caution", "bad"]] = {
    "right": "good",
    "too small": "bad",
    "too large": "caution",
}


_NOT_SIMULATED = dict.fromkeys(("prior", "block", "reference", "tip", "unknown_size"), ())
"""What is simulated is one tip on one sphere, ring or pin."""


class CheckBudget(Qualify, without=_NOT_SIMULATED):
    """Check the coverage of U by simulation: repeat your own qualification many times and count.

    Each simulated probe is drawn from the map of your touches and the uncertainty of this map. The
    probe repeats your touches, with your settings, and then measures faces and a bore whose
    positions are known. The true errors are those of your settings; --true-… gives other true
    errors, for example a diameter that is worse than its certificate says.

    Exit code 3: U is too small.
    """

    name = "check-budget"
    example = "pretravel check-budget sphere.csv --diameter 25 --tip-diameter 6 --sets 200"

    sets: Annotated[int, Field(help="Simulated qualifications.", range=(20, 100000))] = 100
    bore: Annotated[
        float,
        Field(
            help="Diameter of the bore that is measured, in mm.",
            range=REFERENCE_DIAMETER,
            label="Diameter of the bore",
        ),
    ] = 20.0
    bore_touches: Annotated[
        int, Field(help="Touches in the bore.", range=(4, 1000), label="Touches in the bore")
    ] = 8
    true_noise_um: Annotated[
        float | None,
        Field(
            help="True noise of a touch, in µm, standard deviation; the default is the noise of "
            "your touches.",
            range=NOISE,
            label="True noise of a touch",
        ),
    ] = None
    true_u_diameter_um: Annotated[
        float | None,
        Field(
            help="True standard deviation of the error of the diameter, in µm; the default follows "
            "from --u-diameter and --u-temperature.",
            range=U_OF_DIAMETER,
            label="True error of the diameter",
        ),
    ] = None
    true_hysteresis_um: Annotated[
        float,
        Field(
            help="True hysteresis, in µm: shift of the tip's rest position by the touch before.",
            range=NOISE,
            label="True hysteresis",
        ),
    ] = 0.0
    machine: Annotated[
        Path | None,
        Field(
            help="Errors of machine and probe, which pretravel separate has written: .json or "
            ".csv. Its errors and scatter act in the direction of each touch, and points are "
            "compensated with it.",
            label="Separation of machine and probe",
            reads=True,
        ),
    ] = None
    seed: Annotated[
        int, Field(help="Seed of the simulation: the same seed gives the same answer.",
                   range=(0, 2**32 - 1)),
    ] = 1  # fmt: skip
    output: Annotated[
        Path | None,
        output("Table of the coverage: .csv; or a page, .html or .pdf.", ".csv", *PAGES),
    ] = None

    def endings(self, output: str) -> tuple[str, ...]:
        """A table or a page, on whatever reference."""
        return Task.endings(self, output)

    def run(self, progress: Progress = SILENT) -> CheckedBudget:  # type: ignore[override]
        """Qualify, simulate, count."""
        import numpy as np

        from pretravel.drawing.tasks.check_budget.budget_check import ActingErrors, check_budget
        from pretravel.files import read_touch_scatter

        readings = self.read(progress)
        with progress.working(f"qualifying on {len(readings.touches)} touches"):
            qualification = self.qualified(readings).qualification
        setup = qualification.pretravel_map.provenance.setup
        assert setup is not None
        stated = self.true_u_diameter_um
        noise = self.true_noise_um
        acting = ActingErrors(
            qualification.pretravel_map.single_touch if noise is None else noise * MICROMETRE,
            setup.u_reference_diameter if stated is None else stated * MICROMETRE,
            setup.sphere_form,
            self.true_hysteresis_um * MICROMETRE,
            None if self.machine is None else read_touch_scatter(self.machine),
        )
        if setup.tip_diameter is not None and self.bore <= setup.tip_diameter:
            raise PretravelError(
                f"a bore of {self.bore:g} mm is not wider than the tip of {setup.tip_diameter:g} "
                "mm: give another one",
                inputs=("bore",),
            )
        used = readings.touches.take(np.flatnonzero(qualification.used))
        bore = (self.bore, self.bore_touches)
        with progress.working(f"simulating {self.sets} qualifications"):
            found = check_budget(
                used,
                qualification,
                partial(_qualified, self, readings),
                acting,
                sets=self.sets,
                bore=bore,
                rng=self.seed,
            )
        return CheckedBudget(self, readings, found)


def _qualified(task: CheckBudget, readings: FileReadings, touches: Touches) -> Qualification:
    """Other touches, qualified with the settings of the task; other processes can call it."""
    return task.qualified(replace(readings, touches=touches)).qualification


@dataclass(frozen=True, eq=False)
class CheckedBudget(Result):
    """How often U contained the error."""

    task: CheckBudget
    readings: FileReadings
    check: BudgetCheck

    @property
    def exit_code(self) -> int:  # type: ignore[override]
        """3 where U is too small."""
        return ANSWER if self.check.verdict == "too small" else 0

    def document(self) -> Document:
        """The report, with what the laboratory states."""
        from pretravel.show import Document, Judgement, KeyFigure, Picture, decimals
        from pretravel.task import with_laboratory

        found, acting = self.check, self.check.acting
        report = Document(
            title=f"{self.task.touches_name}: coverage of U",
            verdict=_WORDS[found.verdict],
            judgement=Judgement(_LEVELS[found.verdict], found.verdict.capitalize()),
            figures=(
                *(_figure(each) for each in found.coverages),
                KeyFigure("simulated qualifications", found.sets, "", decimals(0)),
            ),
            tables=(_table(found),),
            pictures=(Picture("Shares of errors within U", lambda: coverage_view(found)),),
            notes=(
                (
                    f"Simulated errors: noise {acting.noise / MICROMETRE:.2f} µm, diameter of "
                    f"the reference {acting.diameter / MICROMETRE:.2f} µm (with its "
                    "temperature), its form "
                    f"{acting.form / MICROMETRE:.2f} µm, hysteresis "
                    f"{acting.hysteresis / MICROMETRE:.2f} µm{_separated(self.task)}. "
                    f"The bore is {self.task.bore:g} mm wide, touched {self.task.bore_touches} "
                    "times."
                ),
                (
                    "The probes are drawn from your map: what no map of this kind can show, a "
                    "drift of the machine and errors of its axes are not in these numbers."
                ),
            ),
            warnings=(
                *self.readings.notes(), *_refusals(found), *self.task.statement_warnings()
            ),
        )  # fmt: skip
        return with_laboratory(report, self.task.statements())

    def write(self, output: str, path: Path) -> None:
        """Write the table."""
        del output
        import numpy as np

        from pretravel.files import write_csv_table

        found = self.check.coverages
        write_csv_table(path, {
            "quantity": [each.name for each in found],
            "share_within_u_percent": np.array([100.0 * each.share for each in found]),
            "share_lower_percent": np.array([100.0 * each.interval[0] for each in found]),
            "share_upper_percent": np.array([100.0 * each.interval[1] for each in found]),
            "rms_error_um": np.array([_rms(each.errors) for each in found]),
            "rms_u_um": np.array([_rms(each.u) for each in found]),
            "chi_squared": np.array([each.chi_squared for each in found]),
            "needed_factor": np.array([each.needed for each in found]),
            "verdict": [each.verdict for each in found],
        })  # fmt: skip


def _separated(task: CheckBudget) -> str:
    """What acts in addition, where a separation was given."""
    if task.machine is None:
        return ""
    return (
        f"; errors of the machine, and the scatter of machine and probe, by the direction of each "
        f"touch, from {task.machine.name} (the noise is that along the axis)"
    )


def _rms(values: FloatArray) -> float:
    import numpy as np

    return float(np.sqrt(np.mean(values**2))) / MICROMETRE


def _figure(each: Coverage) -> KeyFigure:
    from pretravel.drawing.tasks.check_budget.budget_check import TOO_LARGE
    from pretravel.show import KeyFigure, decimals

    low, high = (100.0 * end for end in each.interval)
    perhaps = ""
    if each.verdict == "right" and each.needed < 1.0 / TOO_LARGE:
        perhaps = "; U may be too large, and only more sets can show it"
    return KeyFigure(
        f"{each.name}: errors within U", 100.0 * each.share, "%", decimals(1),
        remark=f"{low:.1f} to {high:.1f} %; nominal 95.4 %: {each.verdict}{perhaps}",
    )  # fmt: skip


def _refusals(found: BudgetCheck) -> list[str]:
    if not found.refused:
        return []
    return [
        (
            f"{len(found.refused)} of {found.sets + len(found.refused)} simulated qualifications "
            f"were refused, the first one because: {found.refused[0]}"
        )
    ]


def _table(found: BudgetCheck) -> Table:
    from pretravel.show import Column, Table, decimals

    each = found.coverages
    return Table(
        (
            Column.of("quantity", [one.name for one in each]),
            Column.of("error (rms)", [_rms(one.errors) for one in each], "µm", decimals(2)),
            Column.of("u (rms)", [_rms(one.u) for one in each], "µm", decimals(2)),
            Column.of("χ²", [one.chi_squared for one in each], "", decimals(2)),
            Column.of("U × this covers 95.4 %", [one.needed for one in each], "", decimals(2)),
            Column.of("verdict", [one.verdict for one in each]),
        ),
        "Errors compared with the given uncertainties:",
        "χ² is the mean of (error/u)²: 1 where u is right. U times the next number would have "
        "contained 95.4 % of the errors. Too small: the interval of the share lies below 95.4 %; "
        "too large: above it, and U could be smaller by a factor of 1.5.",
    )


def coverage_view(found: BudgetCheck) -> View:
    """Shares of the errors within U, and the errors of single points over their u."""
    import numpy as np

    from pretravel.show import Axis, Dots, LineMark, PlaneChart, Rule, View, interval_lines
    from pretravel.uncertainty import EXPANDED_COVERAGE

    each = found.coverages
    place = np.arange(float(len(each)))
    low, high = (100.0 * np.array([one.interval[end] for one in each]) for end in (0, 1))
    shares = PlaneChart(
        "Share of errors within U",
        Axis("", categories=tuple(one.name for one in each)),
        Axis("share", "%"),
        (
            Rule(100.0 * EXPANDED_COVERAGE, "stated"),
            interval_lines(place, low, high, "interval of 95 %"),
            Dots(place, np.array([100.0 * one.share for one in each]), "attained"),
        ),
    )
    points = each[0]
    u, error = points.u.ravel() / MICROMETRE, points.errors.ravel() / MICROMETRE
    edge = np.array([float(u.min()), float(u.max())])
    some = slice(None, None, max(1, len(u) // 2000))
    scatter = PlaneChart(
        "Errors of single points",
        Axis("u", "µm"),
        Axis("error", "µm"),
        (
            LineMark(edge, 2.0 * edge, "U", "series2"),
            LineMark(edge, -2.0 * edge, "", "series2"),
            Dots(u[some], error[some], points.name, "series1"),
        ),
    )
    return View("Coverage of U", (shares, scatter), 2)
