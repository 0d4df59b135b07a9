"""What a laboratory states in reports and certificates: itself, its instrument, the reference."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields

from pretravel.base import STEEL_EXPANSION
from pretravel.files.report_tables import REPORT_TABLES
from pretravel.files.words_of_lines import days_in_text


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
class ComparedStandards:
    """Standards whose text the laboratory compared with what is used here; a meaning begins with
    the name of the standard.
    """

    iso_10360_5: str = _statement("ISO 10360-5: edition compared, by whom, when")
    iso_230_10: str = _statement("ISO 230-10: edition compared, by whom, when")
    iso_14253_1: str = _statement("ISO 14253-1: edition compared, by whom, when")
    iso_iec_17025: str = _statement("ISO/IEC 17025: edition compared, by whom, when")


@dataclass(frozen=True)
class LaboratoryStatements:
    """Everything on a certificate or a report that the laboratory states, not the measurement.

    The fields of a certificate are what ISO/IEC 17025:2017, 7.8.2 and 7.8.4 require, from memory:
    they were not compared with its text. The other reports contain the tables of `REPORT_TABLES`.
    A file has a table of the same name for each of them.

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
    standards: ComparedStandards = ComparedStandards()

    @property
    def missing(self) -> int:
        """Number of statements that a certificate needs and that are open."""
        return sum(not statement.text for statement in self.of_certificate())

    def of_certificate(self) -> Iterator[LaboratoryStatement]:
        """What a certificate needs, and everything else that is stated."""
        return (s for s in self.statements() if s.table in CERTIFICATE_TABLES or s.text)

    def of_report(self) -> Iterator[LaboratoryStatement]:
        """What any report needs, and everything else that is stated.

        >>> [statement.key for statement in LaboratoryStatements().of_report()][:4]
        ['name', 'place', 'accreditation', 'machine']
        """
        open_or_not = sorted(self.statements(), key=_place_in_report)
        return (s for s in open_or_not if s.table in REPORT_TABLES or s.text)

    def compared(self, standard: str) -> str:
        """What the laboratory states of its comparison with the text of a standard.

        Parameters
        ----------
        standard : str
            Its name, also with the part that is meant: ``ISO 10360-5, single stylus``.

        Returns
        -------
        str
            Empty where it compared nothing.

        >>> stated = LaboratoryStatements(standards=ComparedStandards(iso_230_10="2016, A. Lee"))
        >>> stated.compared("ISO 230-10, stylus-tip offset"), stated.compared("ISO 230-1")
        ('2016, A. Lee', '')
        """
        for key in fields(self.standards):
            name = key.metadata["meaning"].partition(":")[0]
            if standard.partition(",")[0] == name:
                return str(getattr(self.standards, key.name))
        return ""

    def contradictions(self, used: Mapping[str, object]) -> Iterator[tuple[str, str]]:
        """What is stated against the settings of a task, or twice and differently.

        Parameters
        ----------
        used : mapping of str to value
            Settings by their names, of which diameter, tip_diameter [mm], u_diameter_um, feed
            [mm/min] and temperature [°C] are compared with numbers in the statements that have
            their unit.

        Returns
        -------
        iterator of setting and sentence

        >>> stated = LaboratoryStatements(reference=ReferenceIdentity("sphere 30 mm, U = 1.2 µm"))
        >>> [said for _, said in stated.contradictions({"diameter": 24.9987})]
        ["what is used: it gives 'sphere 30 mm, U = 1.2 µm', and 24.9987 is used"]
        >>> used = {"diameter": 30.0, "u_diameter_um": 1.2}
        >>> [said for _, said in stated.contradictions(used)]
        ["what is used: it gives 'sphere 30 mm, U = 1.2 µm' (u = 0.6 µm), and u = 1.2 µm is used"]
        """
        for name, text, pattern, apart in (
            ("diameter", self.reference.description, _MILLIMETRES, _DIAMETERS_APART),
            ("tip_diameter", self.instrument.stylus, _OF_TIP, _DIAMETERS_APART),
            ("temperature", self.conditions.temperature, _DEGREES, _TEMPERATURES_APART),
            ("feed", self.method.feed, _FEED, 0.0),
        ):
            value = used.get(name)
            read = {"feed": _feeds, "temperature": _celsius}.get(name)
            stated = (
                read(text) if read else [_number("".join(each)) for each in pattern.findall(text)]
            )
            if not (isinstance(value, (int, float)) and stated):
                continue
            if min(abs(each - value) for each in stated) > apart:
                yield name, f"what is used: it gives '{text}', and {value:g} is used"
        yield from self._other_u(used)
        rod, fed = used.get("rod_feed"), self.method.feed
        stated = _feeds(fed)
        of_rod = rod if isinstance(rod, float) else math.nan
        apart = min((abs(each / of_rod - 1.0) for each in stated), default=0.0)
        if apart > _ROD_FEEDS_APART:  # not of a nan
            yield "traces", f"the traces: it gives '{fed}', and their rod has {of_rod:.3g} mm/min"
        yield from self._other_days()
        item, probe = self.item.serial_number, self.instrument.probe_serial_number
        one, other = _WITH_DIGITS.findall(item), _WITH_DIGITS.findall(probe)
        if one and other and not {*one} & {*other}:
            yield "lab", f"itself: the calibrated item has number '{item}', the probe '{probe}'"

    def _other_days(self) -> Iterator[tuple[str, str]]:
        """Dates of a certificate in another order than its work; standards that were not valid."""
        received, calibrated, issued = (
            next(iter(days_in_text(text)), None)
            for text in (self.item.received, self.item.calibrated, self.certificate.date_of_issue)
        )
        for one, what, later, then in (
            (received, "received", calibrated, "calibrated"),
            (calibrated, "calibrated", issued, "issued"),
        ):
            if one and later and later < one:
                yield "lab", f"itself: it was {what} on {one} and {then} on {later}"
        measured = calibrated or next(iter(days_in_text(self.measurement.date)), None)
        if measured is None:
            return
        for text in (self.traceability.statement, self.reference.certificate):
            until = days_in_text(_after(_EXPIRES, text))
            if until and until[0] < measured:
                yield "lab", f"itself: it gives '{text}', and the measurement is of {measured}"

    def warm_reference(self, diameter: float, u_temperature: float) -> str:
        """A sentence where a reference is not at the temperature at which its diameter holds.

        Parameters
        ----------
        diameter : float
            [mm]
        u_temperature : float
            Of the reference, as it is used. [K]

        >>> stated = LaboratoryStatements(conditions=AmbientConditions("27.0 °C"))
        >>> print(stated.warm_reference(25.0, 0.2))
        it gives '27.0 °C', and u of the temperature is 0.2 K: if the diameter is that at 20 °C, a \
steel sphere is larger by 2.0 µm, which U does not contain. Give the diameter at the temperature \
of the touches
        >>> stated.warm_reference(25.0, 4.0)
        ''
        """
        text = self.conditions.temperature
        apart = min(_celsius(text), default=20.0) - 20.0
        if abs(apart) <= max(_TEMPERATURES_APART, 2.0 * u_temperature):
            return ""
        grown = 1e3 * STEEL_EXPANSION * diameter * apart
        return (
            f"it gives '{text}', and u of the temperature is {u_temperature:g} K: if the diameter "
            f"is that at 20 °C, a steel sphere is {'larger' if grown > 0.0 else 'smaller'} by "
            f"{abs(grown):.1f} µm, which U does not contain. Give the diameter at the temperature "
            "of the touches"
        )

    def _other_u(self, used: Mapping[str, object]) -> Iterator[tuple[str, str]]:
        """A standard uncertainty of the diameter that is not the one that is used."""
        if used.get("diameter") is None or "u_diameter_um" not in used:
            return
        value = used["u_diameter_um"]
        for text in (self.reference.description, self.reference.certificate):
            factor = _COVERAGE.search(text)
            k = 2.0 if factor is None else _number(factor[1])
            stated = [
                _number(size) * _MICROMETRES[unit.replace("μ", "µ")] / (1.0 if name == "u" else k)
                for name, size, unit in _UNCERTAINTY.findall(text)
            ]
            close = isinstance(value, (int, float)) and any(
                abs(each - value) <= _UNCERTAINTIES_APART * each for each in stated
            )
            if stated and not close:
                other = (
                    "no u of the diameter is given"
                    if value is None
                    else f"u = {value:g} µm is used"
                )
                said = f"it gives '{text}' (u = {stated[0]:g} µm), and {other}"
                yield "u_diameter", f"what is used: {said}"

    def statements(self) -> Iterator[LaboratoryStatement]:
        """All statements in the order of the file."""
        for table in fields(self):
            part = getattr(self, table.name)
            for key in fields(part):
                yield LaboratoryStatement(
                    table.name, key.name, key.metadata["meaning"], getattr(part, key.name)
                )


_MILLIMETRES = re.compile(r"(\d+(?:[.,]\d+)?) ?mm\b")
_OF_TIP = re.compile(
    r"(?:\b(?:tip|ball|kugel)\W{0,3}(?:Ø|⌀|dia(?:meter)?)?\W{0,2}|[Ø⌀]\W?)(\d+(?:[.,]\d+)?) ?mm\b|"
    r"(\d+(?:[.,]\d+)?) ?mm[- ](?:tip|ball|kugel)\b",
    re.IGNORECASE,
)
_DEGREES = re.compile(r"^\D{0,3}(-?\d+(?:[.,]\d+)?)")
_EXPIRES = re.compile(r"\b(?:until|valid to|till|expire\w*|gültig bis)\b", re.IGNORECASE)
_NEXT = 14
"""Characters of a date and the signs before it."""
_FAHRENHEIT = re.compile(r"^\D{0,3}-?\d+(?:[.,]\d+)? ?°? ?F\b")
_FEED = re.compile(r"(\d+(?:[.,]\d+)?) ?mm/(min|s)\b")
_UNCERTAINTY = re.compile(
    r"(?:\b([Uu])(?:95|99)?\s?(?:\([^)]*\))?\s?[=:]|±)\s?(\d+(?:[.,]\d+)?) ?(nm|[µμu]m|mm)\b"
)
_COVERAGE = re.compile(r"\bk\s?=\s?([1-9]\d*(?:[.,]\d+)?)")
_MICROMETRES = {"nm": 1e-3, "um": 1.0, "µm": 1.0, "mm": 1e3}
_UNCERTAINTIES_APART = 0.1
"""Share by which a rounded uncertainty may differ."""
_WITH_DIGITS = re.compile(r"\w*\d\w*")


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def _feeds(text: str) -> list[float]:
    """Feeds in a text. [mm/min]"""
    found = [(_number(size), unit) for size, unit in _FEED.findall(text)]
    return [60.0 * size if unit == "s" else size for size, unit in found]


_DIAMETERS_APART = 0.5
"""Of a nominal diameter and a calibrated or effective one. [mm]"""
_ROD_FEEDS_APART = 0.1
"""Relative difference of a feed and the speed of a rod in its traces."""
_TEMPERATURES_APART = 1.0
"""Of a room and a ruler in it. [K]"""
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


def _place_in_report(statement: LaboratoryStatement) -> int:
    """Tables of every report first, in their order."""
    known = statement.table in REPORT_TABLES
    return REPORT_TABLES.index(statement.table) if known else len(REPORT_TABLES)


@dataclass(frozen=True)
class LaboratoryStatement:
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


def _after(words: re.Pattern[str], text: str) -> str:
    """What follows these words at once; empty where they are not there."""
    found = words.search(text)
    return "" if found is None else text[found.end() : found.end() + _NEXT]


def _celsius(text: str) -> list[float]:
    """The temperature that a text begins with. [°C]"""
    scale = (lambda value: (value - 32.0) / 1.8) if _FAHRENHEIT.search(text) else float
    return [scale(_number(each)) for each in _DEGREES.findall(text)]
