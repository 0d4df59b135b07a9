"""Lines among the rows of a format that are not data: harmless, or changing what rows mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from pretravel.files.source_file import SourceFile, shortened

StatementMeaning: TypeAlias = Literal[
    "nothing", "tip", "frame", "unit", "radius", "part", "pass", "orientation"
]
"""What a statement changes for the rows after it; radius: what was subtracted from the points."""
StatementOutcome: TypeAlias = Literal["harmless", "carried", "refused", "named"]
_SHOWN = 3
"""Most unknown lines that a warning quotes."""


@dataclass(frozen=True)
class RowStatement:
    """One kind of line of a format that contains no reading.

    Attributes
    ----------
    words : str
        How it looks, for the documentation: ``TIP/…``.
    pattern : str
        Regular expression at the beginning of the line, without regard to case. Its first group,
        where it has one, is the value that it states.
    means : str
        What it changes.
    then : str
        harmless: it is passed over; carried: rows state it in a column; refused: rows before and
        after it are not read together; named: a warning says that it is not read.
    example : str
        A line of the format, for tests.
    event : bool
        The same value again is another one: the machine was homed again.
    """

    words: str
    pattern: str
    means: StatementMeaning = "nothing"
    then: StatementOutcome = "harmless"
    example: str = ""
    event: bool = False


def any_of(words: str) -> str:
    """A pattern of words apart by blanks, with _ for a blank within a word.

    >>> re.match(any_of("MOVE TEMP_COMP"), "TEMP COMP/1")[0]
    'TEMP COMP'
    """
    every = sorted(words.split(), key=len, reverse=True)
    return "(?:" + "|".join(re.escape(word).replace("_", r"\s?") for word in every) + r")\b"


class RowStatements:
    """The statements of a format, tried in order.

    Parameters
    ----------
    table : sequence of RowStatement
    """

    def __init__(self, table: Sequence[RowStatement]) -> None:
        self.table = tuple(table)
        self._patterns = [(re.compile(one.pattern, re.IGNORECASE), one) for one in self.table]

    def of(self, line: str) -> tuple[RowStatement, str] | None:
        r"""The statement that a line is, with the value that it states; None: not known.

        >>> table = RowStatements([RowStatement("TIP/…", r"TIP/(\w+)", "tip", "carried")])
        >>> table.of("TIP/T1A0B0, ANGLE=0")[1], table.of("HIT/BASIC")
        ('T1A0B0', None)
        """
        for pattern, statement in self._patterns:
            if found := pattern.match(line):
                stated = next((group for group in found.groups() if group), None)
                return statement, (stated or found[0]).strip()
        return None


@dataclass
class StatedRows:
    """What statements say of the rows while a file is read line by line.

    Attributes
    ----------
    file : SourceFile
    rows : int
        Readings so far.
    values : dict of str to str
        What holds now, by the names of columns: tip, part, pass, orientation.
    words : dict of str to list of str
        What held at each row.
    unknown : list of line and text
        Lines that are not known statements.
    unmeasured : list of line and text
        Lines that say that nothing was measured.
    named : list of line and text
        Lines that are known, and not read.
    of_centres : bool
        The rows are tip centres, so that a note can contradict.
    notes : list of line and text
        Comments and texts, before, between and after the rows.
    """

    file: SourceFile
    rows: int = 0
    values: dict[str, str] = field(default_factory=dict)
    words: dict[str, list[str]] = field(default_factory=dict)
    unknown: list[tuple[int, str]] = field(default_factory=list)
    unmeasured: list[tuple[int, str]] = field(default_factory=list)
    named: list[tuple[int, str]] = field(default_factory=list)
    of_centres: bool = False
    notes: list[tuple[int, str]] = field(default_factory=list)
    _held: dict[str, tuple[str, int]] = field(default_factory=dict)
    _events: dict[str, tuple[int, int]] = field(default_factory=dict)
    _broken: tuple[str, int] | None = None

    def state(self, column: str, value: str) -> None:
        """A statement that is carried: it holds for the rows that follow."""
        self.values[column] = value

    def hold(self, what: str, value: str, number: int) -> None:
        """A statement that is refused where rows are read before it and after it.

        The same value again changes nothing.
        """
        before = self._held.get(what)
        self._held[what] = (value, number)
        if self.rows and (before is None or before[0] != value):
            self._broken = (what, number)

    def take(
        self, found: tuple[RowStatement, str] | None, line: str, number: int, sent: str = ""
    ) -> None:
        """Take a line that is not a reading.

        Parameters
        ----------
        found : RowStatement and value, or None
            From `Statements.of`.
        line : str
        number : int
        sent : str
            The line without what a program wrote before it, where it did.
        """
        if found is None or _NOTE.match(sent or line):
            self.note(line, number, known=found is not None)
        elif re.search(_NOT_MEASURED, line, re.IGNORECASE):
            self.unmeasured.append((number, line))
        if (found is None or _NOTE.match(sent or line)) and changes_rows(line):
            self.hold(f"the meaning of the rows, perhaps ('{shortened(line)}')", line, number)
        if found is None:
            self.unknown.append((number, line))
            return
        statement, value = found
        if statement.then == "carried":
            self.state(statement.means, self._event(value) if statement.event else value)
        elif statement.then == "named":
            self.named.append((number, line))
        elif statement.then == "refused":
            # A shift or turn that is stated again is another one, and so is an event.
            another = statement.means == "frame" or statement.event
            again = f"{value} {number}" if another else value
            self.hold(f"{CHANGES[statement.means]} ({statement.words})", again, number)

    def note(self, line: str, number: int, *, known: bool = True) -> None:
        """Keep what a text says of the rows.

        Raises
        ------
        InputError
            It says that the rows are compensated, and they are tip centres.
        """
        if re.search(_NOT_MEASURED, line, re.IGNORECASE):
            self.unmeasured.append((number, line))
        if self.of_centres:
            refuse_compensated(self.file, line, number)
        if known:
            self.notes.append((number, line))

    def _event(self, value: str) -> str:
        """Name of an event: that of the second time, with rows in between, ends in (2)."""
        times, rows = self._events.get(value, (0, -1))
        times += rows != self.rows
        self._events[value] = (times, self.rows)
        return value if times == 1 else f"{value} ({times})"

    def row(self, number: int, values: Mapping[str, str] | None = None) -> None:
        """A reading on a line: what was stated holds for it.

        Parameters
        ----------
        number : int
        values : mapping of str to str, optional
            What held where the reading began; by default what holds now.

        Raises
        ------
        InputError
            A statement that is not carried stands between this reading and an earlier one.
        """
        if self._broken is not None:
            what, line = self._broken
            raise self.file.error(
                f"this line changes {what} among the touches: those before and after it (line "
                f"{number}) cannot be read as one series. Split the file there",
                line,
            )
        held = self.values if values is None else values
        for name in {*self.words, *held}:
            before = self.words.setdefault(name, [""] * self.rows)
            before.append(held.get(name, ""))
        self.rows += 1

    def columns(self) -> dict[str, tuple[str, ...]]:
        """The words of each row, by column; those before the first statement are empty."""
        return {name: tuple(words) for name, words in self.words.items() if any(words)}

    def warnings(self) -> tuple[str, ...]:
        """Sentences that name the lines that are not known, or say that nothing was measured."""
        of_radius = "" if self.of_centres else f"|{_COMPENSATED.pattern}|{_CENTRES}"
        return (
            *unknown_lines(self.unknown),
            *lines_not_read(self.named),
            *conditions_not_read(self.notes, f"{_CONDITIONS}|{_TIP_SIZE}{of_radius}"),
            *nothing_measured(self.unmeasured),
        )


def changes_rows(line: str) -> bool:
    """Whether a comment, or a line that is not known, can change what the rows after it mean.

    >>> changes_rows("Turn the part over"), changes_rows("coffee break")
    (True, False)
    """
    return re.search(_CHANGES_ROWS, line.replace("_", " "), re.IGNORECASE) is not None


def is_note(line: str) -> bool:
    """Whether a line of a log is a comment or a text.

    >>> is_note("COMMENT/OPER,NO,next part"), is_note("HIT/BASIC")
    (True, False)
    """
    return _NOTE.match(line) is not None


CHANGES: dict[str, str] = {
    "frame": "the coordinates",
    "unit": "the unit",
    "radius": "what was subtracted from the points",
    "tip": "the tip",
    "part": "the part or the series",
    "pass": "the feed",
    "orientation": "the orientation of the probe",
}
"""What a statement changes, in words."""


def unknown_lines(lines: Sequence[tuple[int, str]]) -> tuple[str, ...]:
    """A sentence that names lines whose meaning is not known.

    >>> unknown_lines([(3, "FROB/1")])[0]
    "1 line is not known, and not read: line 3 'FROB/1'"
    """
    if not lines:
        return ()
    shown = ", ".join(f"line {number} '{shortened(text)}'" for number, text in lines[:_SHOWN])
    more = " …" if len(lines) > _SHOWN else ""
    plural = "s are" if len(lines) > 1 else " is"
    return (f"{len(lines)} line{plural} not known, and not read: {shown}{more}",)


def statement_rows(name: str, table: Sequence[RowStatement], other_lines: str) -> list[str]:
    """Rows of the documentation: what each statement of a format changes, and what is done.

    >>> print(statement_rows("dmis", [RowStatement("`UNITS/`", "", "unit", "refused")], "named")[0])
    | `dmis` | `UNITS/` | the unit | refused |
    >>> print(statement_rows("dmis", [], "named")[0])
    | `dmis` | other lines | not known | named |
    """
    rows = []
    for then in ("carried", "refused", "named", "harmless"):
        for one in table:
            if one.then == then:
                words = one.words.replace("|", "\\|")
                outcome = f"column `{one.means}`" if then == "carried" else then
                changes = CHANGES.get(one.means, "nothing")
                rows.append(f"| `{name}` | {words} | {changes} | {outcome} |")
    if other_lines:
        rows.append(f"| `{name}` | other lines | not known | {other_lines} |")
    return rows


Record: TypeAlias = tuple[int, str]
"""Line number and text."""
_THINGS = (
    r"(?:tips?|stylus|styli|stylet|ruby|probe|prb(?=\s?=)|sensor|tool|taster|tastkugel|werkzeug|"
    r"palpeur|palpador|palpatore|tastatore|outil|herramienta|utensile|part|serial|teil|"
    r"werkst(?:ü|ue)ck|workpiece|pi[èe]ce|pieza|pezzo|series|serie|set|pass|fixture|set-?up|"
    r"aufspannung|orientation)"
)
"""What a comment between rows can state or change."""
_A_FEED = (
    r"\b(?:feed|vorschub|avance)(?:rate)?\W*+\d|^\W*F\s?=?\s?\d+(?:\.\d*)?\W*$|"
    r"\b(?:prob|touch|measur|approach|search|antast|mess)\w*[\s_-]?(?:speed|velocity|"
    r"geschwindigkeit|vorschub)\W*\d|\bvitesse\b\D{0,20}\d"
)
_ANGLES = (
    r"^\W*(?:[ABC]\W?[:=]?\W?[-+]?\d+(?:\.\d+)?°?\W*){2,}$|"
    r"^\W*[ABC]\s?(?:=\s?[-+]?\d++(?:[.,]\d*+)?+|[-+]?\d++\.\d*+)°?\W*$"
)
_TURN = (
    r"\bspind(?:le|el)\b\W*(?:(?:angle|orientation|winkel|position|turned|now|is|at|to|auf|[ACRS])"
    r"\W*){0,4}[-+]?\d++(?:[.,]\d++)?+(?!\s*(?:rpm|1/min|u/min|min))"
)
"""The spindle at an angle; at a speed it is not touching."""
_CHANGES_ROWS = (
    rf"\b{_THINGS}(?:\s?(?:no|nr|number|nummer|name|id)\b\.?)?\s*"
    rf"(?:[:=#]|[A-Z]?\d|[A-Z]\b(?!\W+\w)|\bis (?:now )?\w*\d)|"
    rf"\b{_THINGS}\W+(?:(?:is|was|now|has been)\W+)*(?:chang|swap|exchang|replac|gewechsel|wechsel|"
    r"getauscht|turned|flipped|moved|shifted|rotated|gedreht|geschwenkt|gewendet|cambiat)\w*|"
    r"\b(?:werkzeug|taster|tastkopf|teile?|werkst(?:ü|ue)ck)wechsel\b|"
    rf"\b(?:changement|cambio|cambiat[oa]|nouvel(?:le)?|nuov[oa]|nuev[oa])\W+"
    rf"(?:(?:de|d|du|la|le|il|el)\W+)*{_THINGS}\b|"
    r"\b(?:feed(?:rate)?|vorschub)\W+(?:chang|halv|doubl|reduc|increas|geändert|erhöht|halbiert)\w*|"
    r"\b(?:tisch|kopf)\W+(?:gedreht|geschwenkt)\b|"
    rf"\b(?:new|next|other|another|second|2nd|third|3rd|chang\w*|swap\w*|switch\w*|neue[rs]?|nächste[rs]?|"
    rf"andere[rs]?|zweite[rs]?|with|mit)\W+(?:(?:the|a|to|of)\W+)*{_THINGS}\b|"
    r"\b(?:new|next|other|another|second|chang\w*|neue[rs]?|andere[rs]?|zweite[rs]?)\W+"
    r"(?:(?:the|to)\W+)*(?:sphere|kugel|reference|referenz)\b|"
    r"\b(?:sphere|kugel|reference|referenz)\W+(?:no\W+|nr\W+)?\d+\W*$|"
    r"\b(?:units?|einheit(?:en)?)\W*(?:[:=]|mm|in\b|cm\b|µm|inch|zoll|metric|imperial)|"
    r"\b(?:inch|inches|zoll|G2[01]|G5[4-9](?:\.\d)?|G92|G68|wcs|work ?offset|rotat\w*|alignment|"
    r"datum(?!\W{0,3}\d+\.\d)|re-?clamp\w*|umgespannt|"
    r"(?:serial|series|part|tip|tool) (?:no|number)\b)|"
    rf"\b(?:turn|flipp?|mov|shift|clamp|unclamp|loosen)e?(?:d|ing)?\W+(?:(?:the|a)\W+)*{_THINGS}\b|"
    r"\bclamp(?:ed|ing)?\W+(?:(?:it|the part)\W+)?(?:again|over)\b|"
    r"\b\d+(?:[.,]\d+)? ?mm (?:ball|tip|stylus|kugel|taster)\b|"
    r"^\W*(?:fast|slow|schnell|langsam)(?:ly)?(?: (?:pass|touch)\w*)?\W*$|"
    r"^\W*T\d+\b|^\W*(?:N\d+\W+)?M0?6\b(?!\s*[a-zäöü]{3})|\bM0?19\W*[A-Z]\W?[-+]?\d|\bSPOS\b|"
    rf"{_TURN}|"
    r"\b(?:radius|tip|ball|cutter|probe)\W?comp(?:ensation)?\W+(?:on|off|ein|aus|an)\b|"
    rf"{_A_FEED}|"
    rf"{_ANGLES}|"
    r"\b[ABC]\W(?:axis|achse)\b|\b(?:axis|achse)\W[ABC]\b|"
    r"\b(?:coordinate|koordinaten)\W?(?:system)\w*|\b(?:offset|origin|scale|scaling|skalier\w*|"
    r"mirror\w*|gespiegelt|nullpunkt\w*|versatz|polar|cartesian|kartesisch)\b|"
    r"\b(?:re-?qualif|re-?calibrat|re-?home|re-?zero|neu kalibriert|neu eingemessen)\w*|"
    r"\b(?:machine|maschine)\W*(?:[:=#]|[A-Z]?\d|[A-Z]\b)|"
    r"\bdirections?\W+(?:(?:is|was|now)\W+)*(?:revers|chang|turn|invert)\w*"
)
"""Comments that change what rows mean. One that only speaks of a tip or a part is named."""
_NOTE = re.compile(r"(?:[;#(%]|//|\$\$|TEXT\s*/|COMMENT\s*/)", re.IGNORECASE)
"""Begins a line of a log that is a comment or a text."""


_OF_ROWS = (
    r"\b(?:no|without|kein|ohne|sans|sin)\W(?:contact\w*|kontakt|trigger|signal)\b|\bmiss(?:ed)?\b|"
    r"\b(?:prob|touch|antast)\w*\W(?:error|fail\w*|fehler)\b|\b(?:abort|abgebroch|interrompu)\w*|"
    r"\bfalse (?:trigger|trip|touch)\w*|\b(?:ignor|discard|delet|invalid|verwerf|verworfen|"
    r"repeat|redo|redone|doppelt|twice|wiederhol)\w*|"
    r"\b(?:second|other|zweite|andere) (?:side|seite)\b|"
    r"\b(?:turned|flipped) (?:over|around)\b|\bby hand\b|\bmanuell\b|\bcrash|\b[ck]ollision|"
    r"\b(?:back|bottom|rear) ?side\b|\brückseite\b|\bsensitivity\b|"
    r"\b(?:average|mean|mittel(?:wert)?)\W(?:of|aus|von)\W\d|\b\w*(?:force|kraft)\W*+\d"
)
"""Notes about some touches: misses, touches that do not count, another side."""
_CONDITIONS = (
    rf"{_OF_ROWS}|{_A_FEED}|"
    r"\bspind(?:le|el)\b[^\d\n]{0,60}+\d|"
    r"(?:temp[ée]ratur\w{0,12}+|\btemp\b)\D{0,24}\d|\d\s?°\s?[CF]\b|"
    r"\bM0?19\W*[A-Z]\W?[-+]?\d|\bSPOS\b|"
    r"\bnormals?\W+(?:are\W+)?(?:reversed|inverted|inward|into)\b|\border\W+[YZ]\b(?!\W?\d)|"
    rf"{_ANGLES}|"
    r"\bmirror\w*\W+[XYZ]\b|"
    r"\bU(?:95|99)?\s?(?:\([^)]{0,20}\))?\s?[=:]\s?\d|"
    r"\b(?:offset|scale|scaling|mirror\w*|rotat\w*|head|axis|achse|shank|delay|latency|form|"
    r"backlash|umkehrspanne|friction|reibung)\b\W*(?:[A-Z]{1,3}\W*)?[-+]?\d|"
    r"\b(?:tip|stylus|probe|prb|sensor|taster|tool|werkzeug|palpeur|palpador|palpatore|outil|"
    r"herramienta|utensile|orientation|ausrichtung)\b[^\w:=]*+"
    r"(?:(?:name|no|nr|number|id|is)\b[^\w:=]*+)*+(?:[:=]\W*+\w|\w*\d)"
)
"""Lines that state what points depend on, and no option or column reads."""
_TIP_SIZE = (
    r"\b(?:tip|ball|probe|stylus|taster|tastkugel|kugel)\W?(?:ball\W?)?"
    r"(?:dia(?:meter)?|durchmesser|Ø|radius)\W{0,3}\d"
)
"""Lines of logs, which do not compare the size with the one that is given."""


def conditions_not_read(lines: Sequence[Record], words: str = _CONDITIONS) -> tuple[str, ...]:
    """A sentence that names conditions that lines around rows state.

    Parameters
    ----------
    lines : sequence of line and text
    words : str
        Regular expression of conditions.

    >>> conditions_not_read([(1, "# part 7"), (2, "# sphere 25 mm, U = 1.2 µm (k = 2)")])[0]
    "not read: line 2 '# sphere 25 mm, U = 1.2 µm (k = 2)'. Give what it states in a column or as \
an option"
    """
    found = [(number, line) for number, line in lines if re.search(words, line, re.IGNORECASE)]
    return tuple(
        f"{said}. Give what it states in a column or as an option" for said in lines_not_read(found)
    )


def lines_not_read(lines: Sequence[Record]) -> tuple[str, ...]:
    """A sentence that quotes lines which are not read."""
    if not lines:
        return ()
    shown = ", ".join(f"line {number} '{shortened(text)}'" for number, text in lines[:_SHOWN])
    more = " …" if len(lines) > _SHOWN else ""
    return (f"not read: {shown}{more}",)


def comments_among(
    file: SourceFile,
    comments: list[Record],
    lines: Sequence[int],
    is_row: Callable[[str], bool],
) -> tuple[Record, ...]:
    """Comments between the rows, without rows that are comments.

    Parameters
    ----------
    file : SourceFile
    comments : list of line and text
    lines : sequence of int
        Of the rows.
    is_row : function of a text
        Whether a comment without its sign is a row.

    Returns
    -------
    tuple of line and text

    Raises
    ------
    InputError
        One of them speaks of the tip, the part, the unit or the coordinates of the rows.
    """
    among = [
        (number, line)
        for number, line in comments
        if lines[0] < number < lines[-1] and not is_row(line[1:])
    ]
    for number, line in among:
        if re.search(_CHANGES_ROWS, line, re.IGNORECASE):
            raise file.error(
                f"'{shortened(line)}' is between the rows, and may change the meaning of the rows "
                "after it: give its content in a column, or split the table there",
                number,
            )
    return tuple((number, line) for number, line in among if re.search(r"\w", line))


_NOT_MEASURED = (
    r"\bdry[- ]?run\b|\[sim\]|\bno (?:probing|measure(?:ment)?s?|touch(?:es)?)\b|"
    r"\bnot (?:measured|probed)\b|\bnothing (?:was )?(?:measured|probed)\b|"
    r"\bsimulat(?:ed|ion|ion mode)\b|\bsimuliert\b|"
    r"\bpreview\b|\boff-?line\b|\bcheck mode\b|\btrockenlauf\b|\bprobelauf\b|\bdemo data\b"
)
"""Says that rows were not measured."""


def nothing_measured(before: Sequence[Record]) -> tuple[str, ...]:
    """A sentence about lines that say that the rows were not measured.

    >>> nothing_measured([(1, "# DRY RUN")])
    ("line 1 '# DRY RUN' says that the rows were not measured: they are used as if they were",)
    """
    found = [
        (number, line) for number, line in before if re.search(_NOT_MEASURED, line, re.IGNORECASE)
    ]
    if not found:
        return ()
    number, line = found[0]
    said = "says that the rows were not measured: they are used as if they were"
    return (f"line {number} '{shortened(line)}' {said}",)


_COMPENSATED = re.compile(
    r"\b(?:radius|tip|ball|probe|cutter)\W?(?:radius\W?)?(?:comp(?:\.|ensat(?:ion|ed))?|correct(?:ion|"
    r"ed))\W*(?:is\b|was\b)?\W*(?:on|yes|true|1|active|ja|ein|G4[12])\b|"
    r"\b(?:radiuskorrektur|G4[12])\W*(?:on|ein|ja|1|aktiv|active)\b|"
    r"^\W*(?:(?:probe|tip|ball|radius)\W)?(?:compensated|kompensierte)\W(?:points?|positions?|"
    r"coordinates?|data|punkte)\b|"
    r"\b(?:(?:tip|ball|probe|stylus|taster|kugel)\W?)?radius\b[^#;]{0,24}\b(?:subtracted|removed|"
    r"deducted|taken off|compensated|corrected|abgezogen|korrigiert|kompensiert|verrechnet)\b|"
    r"radius(?:korrigierte?|kompensierte?)\b|\bpretravel\b\W+(?:\w+\W+)?(?:compensat|correct|"
    r"subtract|remov)\w*|"
    r"^\W*+(?:(?:all|measured|probed|touched|points?|on|of|the)\W++)*+(?:part\W++)?+"
    r"(?:surface(?:\W++(?:points?|coordinates?))?+|oberflächenpunkte|flächenpunkte)\b\W*+"
    r"(?:(?:coordinates|in|are|mm|inch)\b\W*+)*+$",
    re.IGNORECASE,
)
"""A line that says that the radius, or the pretravel, is subtracted already."""
_CENTRES = r"\b(?:tip|ball|probe|kugel|taster)\W?(?:cent(?:er|re)s?|mittelpunkte?)\b"
_NOT_SUBTRACTED = re.compile(
    r"\b(?:not?|un\w*|nicht|without|ohne|before|vor|none|off|aus|false|nein)\b|(?<![\d.,])0(?![\d.,])",
    re.IGNORECASE,
)


def refuse_compensated(file: SourceFile, line: str, number: int) -> None:
    """Refuse rows of which a line says that they are compensated.

    Raises
    ------
    InputError

    >>> refuse_compensated(SourceFile("a.txt", b""), "# tip radius not subtracted", 1)
    """
    if _COMPENSATED.search(line) and not _NOT_SUBTRACTED.search(line):
        raise file.error(
            f"'{shortened(line)}': positions that the control or the CMM compensated. The "
            "centre of the tip at the trigger is needed. If they are tip centres, leave this "
            "line out",
            number,
        )
