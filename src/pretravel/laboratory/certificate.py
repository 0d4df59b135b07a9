"""The data of a calibration certificate: statements of the laboratory, and results of the rig."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields

from pretravel.laboratory.rig import REFERENCE_TEMPERATURE
from pretravel.laboratory.rig_budget import (
    LengthComponent,
    calibration_budget,
    constant_and_slope,
    length_budget,
)
from pretravel.laboratory.rig_calibration import DirectionPerformance, RigCalibration
from pretravel.laboratory.rig_left_out import left_out_sentences
from pretravel.uncertainty.gum import Budget


def _statement(meaning: str) -> str:
    """A text that the laboratory states; empty where it is open."""
    text: str = field(default="", metadata={"meaning": meaning})
    return text


@dataclass(frozen=True)
class LaboratoryIdentity:
    """The laboratory that issues a certificate."""

    name: str = _statement("Name and address of the laboratory")
    place: str = _statement("Place of calibration, if another")
    accreditation: str = _statement("Accreditation, with its number")


@dataclass(frozen=True)
class CertificateIdentity:
    """The certificate itself."""

    number: str = _statement("Unique number of this certificate")
    date_of_issue: str = _statement("Date of issue")
    authorised_by: str = _statement("Name and function of the person who authorises it")


@dataclass(frozen=True)
class Customer:
    """The customer of a calibration."""

    name: str = _statement("Name and address of the customer")


@dataclass(frozen=True)
class CalibratedItem:
    """The probe that was calibrated."""

    description: str = _statement("What was calibrated: probe, stylus, tip")
    manufacturer: str = _statement("Manufacturer and type")
    serial_number: str = _statement("Serial number")
    condition: str = _statement("Condition on receipt, adjustments")
    received: str = _statement("Date of receipt")
    calibrated: str = _statement("Date of calibration")


@dataclass(frozen=True)
class CalibrationMethod:
    """The procedure of a calibration."""

    procedure: str = _statement("Procedure and its edition")
    feed: str = _statement("Feed and direction of touches, number of repeats")
    deviations: str = _statement("Deviations from the procedure")


@dataclass(frozen=True)
class AmbientConditions:
    """The conditions during a calibration."""

    temperature: str = _statement("Temperature in °C, with its uncertainty")
    humidity: str = _statement("Relative humidity")


@dataclass(frozen=True)
class Traceability:
    """The metrological traceability of a calibration."""

    statement: str = _statement("Standards used, and how they are traceable to the SI")


@dataclass(frozen=True)
class ConformityDecision:
    """The rule by which a laboratory states conformity."""

    rule: str = _statement("Conformity: specification and decision rule, if one was agreed")


@dataclass(frozen=True)
class MeasuringInstrument:
    """The machine with its probe and stylus."""

    machine: str = _statement("Machine, CMM or rig: manufacturer and type")
    machine_serial_number: str = _statement("Serial number of the machine, CMM or rig")
    probe: str = _statement("Probe: manufacturer and type")
    probe_serial_number: str = _statement("Serial number of the probe")
    stylus: str = _statement("Stylus: type, length, tip")
    stylus_serial_number: str = _statement("Serial number of the stylus")


@dataclass(frozen=True)
class ReferenceIdentity:
    """The reference sphere or ring that was touched."""

    description: str = _statement("Reference sphere or ring: manufacturer and type")
    serial_number: str = _statement("Serial number of the reference")
    certificate: str = _statement("Certificate of the reference: number, date, laboratory")


@dataclass(frozen=True)
class MeasurementRecord:
    """Who measured, and when."""

    operator: str = _statement("Operator")
    date: str = _statement("Date and time of the measurement")


@dataclass(frozen=True)
class LaboratoryStatements:
    """Everything on a certificate or a report that the laboratory states, not the measurement.

    The fields of a certificate are what ISO/IEC 17025:2017, 7.8.2 and 7.8.4 require (recalled, not
    checked against the text). The other reports contain the tables of `REPORT_TABLES`. A file has
    a table of the same name for each of them.

    >>> statements = LaboratoryStatements(certificate=CertificateIdentity(number="C-17"))
    >>> statements.missing
    19
    """

    laboratory: LaboratoryIdentity = LaboratoryIdentity()
    certificate: CertificateIdentity = CertificateIdentity()
    customer: Customer = Customer()
    item: CalibratedItem = CalibratedItem()
    method: CalibrationMethod = CalibrationMethod()
    conditions: AmbientConditions = AmbientConditions()
    traceability: Traceability = Traceability()
    decision: ConformityDecision = ConformityDecision()
    instrument: MeasuringInstrument = MeasuringInstrument()
    reference: ReferenceIdentity = ReferenceIdentity()
    measurement: MeasurementRecord = MeasurementRecord()

    @property
    def missing(self) -> int:
        """Number of statements that a certificate needs and that are open."""
        return sum(not statement.text for statement in self.of_certificate())

    def of_certificate(self) -> Iterator[Statement]:
        """What a certificate needs, and everything else that is stated."""
        return (s for s in self.statements() if s.table in CERTIFICATE_TABLES or s.text)

    def of_report(self) -> Iterator[Statement]:
        """What any report needs, and everything else that is stated.

        >>> [statement.key for statement in LaboratoryStatements().of_report()][:4]
        ['name', 'place', 'accreditation', 'machine']
        """
        open_or_not = sorted(self.statements(), key=_place_in_report)
        return (s for s in open_or_not if s.table in REPORT_TABLES or s.text)

    def statements(self) -> Iterator[Statement]:
        """All statements in the order of the file."""
        for table in fields(self):
            part = getattr(self, table.name)
            for key in fields(part):
                yield Statement(
                    table.name, key.name, key.metadata["meaning"], getattr(part, key.name)
                )


CERTIFICATE_TABLES = (
    "laboratory",
    "certificate",
    "customer",
    "item",
    "method",
    "conditions",
    "traceability",
    "decision",
)
"""Tables of the file that a calibration certificate needs."""
REPORT_TABLES = ("laboratory", "instrument", "reference", "conditions", "measurement")
"""Tables of the file that every other report states, in its order."""


def _place_in_report(statement: Statement) -> int:
    """Tables of every report first, in their order."""
    known = statement.table in REPORT_TABLES
    return REPORT_TABLES.index(statement.table) if known else len(REPORT_TABLES)


@dataclass(frozen=True)
class Statement:
    """One statement of a laboratory.

    Attributes
    ----------
    table, key : str
        Its place in the file of the laboratory.
    meaning : str
        What has to be stated.
    text : str
        Empty where it is open.
    """

    table: str
    key: str
    meaning: str
    text: str


@dataclass(frozen=True)
class CertifiedDirection:
    """The result of one direction.

    Attributes
    ----------
    performance : DirectionPerformance
    expanded : float
        Expanded uncertainty of the mean pretravel, for the number of its touches. [mm]
    coverage_factor : float
        k of the expanded uncertainty.
    """

    performance: DirectionPerformance
    expanded: float
    coverage_factor: float


@dataclass(frozen=True, eq=False)
class CalibrationCertificate:
    """The data of a calibration certificate.

    Attributes
    ----------
    statements : LaboratoryStatements
    calibration : RigCalibration
    directions : tuple of CertifiedDirection
    budget : Budget
        Of the mean pretravel of the direction with the fewest touches. [mm]
    budget_source : str
        The rig or the laboratory to which the budget belongs.
    constant_and_slope : tuple of float, or None
        Of u(L)² = constant² + (slope L)² in mm and mm/mm; None where the budget has not this form.
    feeds : tuple of float
        Smallest and largest feed of the rod, from the traces. [mm/min]
    temperature : float
        Of the ruler; lengths are those at 20 °C. [°C]
    notes : tuple of str
        Irregularities of single touches, and touches that were left out, as sentences.
    """

    statements: LaboratoryStatements
    calibration: RigCalibration
    directions: tuple[CertifiedDirection, ...]
    budget: Budget
    budget_source: str
    constant_and_slope: tuple[float, float] | None
    feeds: tuple[float, float]
    temperature: float
    notes: tuple[str, ...]


def calibration_certificate(
    calibration: RigCalibration,
    components: Sequence[LengthComponent],
    statements: LaboratoryStatements,
    *,
    budget_source: str = "",
    temperature: float = REFERENCE_TEMPERATURE,
) -> CalibrationCertificate:
    """The data of a certificate, from a calibration and the statements of the laboratory.

    Parameters
    ----------
    calibration : RigCalibration
    components : sequence of LengthComponent
        Budget of the rig; the repeatability of the calibration replaces the one that it states.
    statements : LaboratoryStatements
    budget_source : str
        The rig or the laboratory to which the budget belongs.
    temperature : float
        Of the ruler. [°C]

    Returns
    -------
    CalibrationCertificate
    """
    own = calibration_budget(calibration, components)
    feeds = [touch.feed for touch in calibration.touches if math.isfinite(touch.feed)]
    mixed = any(c.constant and c.per_length for c in own)
    return CalibrationCertificate(
        statements=statements,
        calibration=calibration,
        directions=tuple(
            _certified_direction(calibration, components, d) for d in calibration.directions
        ),
        budget=length_budget(own, abs(calibration.pretravel)),
        budget_source=budget_source,
        constant_and_slope=None if mixed else constant_and_slope(own),
        feeds=(min(feeds), max(feeds)),
        temperature=temperature,
        notes=(
            *(f"{t.trace}: {note}" for t in calibration.touches for note in t.notes),
            *left_out_sentences(calibration),
        ),
    )


def _certified_direction(
    calibration: RigCalibration,
    components: Sequence[LengthComponent],
    direction: DirectionPerformance,
) -> CertifiedDirection:
    """The mean pretravel of a direction with U and k, for its number of touches."""
    single = calibration_budget(calibration, components, direction.count)
    budget = length_budget(single, abs(direction.pretravel))
    return CertifiedDirection(direction, budget.expanded(), budget.coverage_factor())
