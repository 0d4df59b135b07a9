"""A small interpreter of Macro B, strict where controls differ: what it runs, they all accept.

It runs programs as they are written to files: assignments, IF … THEN, IF … GOTO, GOTO, WHILE … DO,
G65 with arguments, alarms in #3000. Other blocks with words go to a function that moves a machine.

Facts: public manuals and courses on Fanuc and Haas macros. A program is in capitals; a number has
at most eight digits and no exponent; brackets nest five deep; #1 to #33 are local to a call; a
variable without a value is zero in arithmetic, but not in a comparison with EQ; ATAN[a]/[b]
is an angle from 0 to 360 or from -180 to 180 degrees, by a parameter.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

DEEPEST = 5
DIGITS = 8
COMMENT = re.compile(r"\(([^()]*)\)")
TOKEN = re.compile(
    r"(?P<number>\d+\.?\d*|\.\d+)|(?P<name>[A-Z]+)|(?P<sign>[#\[\]+\-*/=])|(?P<space> +)"
)
Value = float | None
MODES = {
    4001: (0.0, 1.0, 2.0, 3.0, 33.0),
    4003: (90.0, 91.0),
    4005: (94.0, 95.0),
    4006: (20.0, 21.0),
    4007: (40.0, 41.0, 42.0),
}
"""Variables that contain the active G code of a group."""
_POWER_ON: Mapping[int, Value] = {
    4001: 0.0, 4003: 90.0, 4005: 94.0, 4006: 21.0, 4007: 40.0, 4109: 0.0,
}  # fmt: skip
COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    "EQ": lambda a, b: a == b,
    "NE": lambda a, b: a != b,
    "GT": lambda a, b: a > b,
    "GE": lambda a, b: a >= b,
    "LT": lambda a, b: a < b,
    "LE": lambda a, b: a <= b,
}
NGC_ALIASES = ((10_100, 10_199), (10_500, 10_999))
"""Of Haas's Next Generation Control, as public tables of its macro variables list them."""
ARGUMENTS = {"I": 4, "J": 5, "K": 6, "D": 7, "F": 9, "R": 18}


class MacroAlarm(Exception):  # noqa: N818, an alarm is what the control calls it
    """What #3000 shows."""

    def __init__(self, number: int, text: str) -> None:
        super().__init__(f"{number} {text}")
        self.number = number
        self.text = text


class MacroSyntaxError(Exception):
    """A line that a control would refuse."""


@dataclass
class MacroControl:
    """A control with programs and variables.

    Attributes
    ----------
    two_value_atan : bool
        Whether ATAN[a]/[b] may be used.
    signed_atan : bool
        Whether ATAN[a]/[b] is from -180 to 180 degrees.
    aliases : tuple of (int, int)
        Variables that are those of a number lower by 10000.
    """

    programs: dict[int, list[str]] = field(default_factory=dict)
    variables: dict[int, Value] = field(default_factory=lambda: dict(_POWER_ON))
    two_value_atan: bool = True
    signed_atan: bool = False
    aliases: tuple[tuple[int, int], ...] = ()
    move: Callable[[MacroControl, list[tuple[str, float]]], None] | None = None

    def load(self, text: str) -> None:
        """Store a file: % around programs that begin with their O number."""
        lines = text.split("\n")
        assert lines[0] == "%"
        assert lines[-2:] == ["%", ""]
        number = 0
        for line in lines[1:-2]:
            if found := re.fullmatch(r"O(\d{4,5})( \([^()]*\))?", line):
                number = int(found[1])
                assert number not in self.programs
                self.programs[number] = []
            else:
                self.programs[number].append(line)

    def own(self, number: int) -> int:
        """The variable behind a number."""
        other = any(low <= number <= high for low, high in self.aliases)
        return number - 10_000 if other else number

    def run(self, number: int, arguments: Mapping[str, float] | None = None) -> None:
        """Call a program like G65."""
        given = {ARGUMENTS[word]: value for word, value in (arguments or {}).items()}
        _Call(self, [_Block(line) for line in self.programs[number]], dict(given)).run()


class _Block:
    """A line: its label, its text without comments, and the comment."""

    def __init__(self, line: str) -> None:
        if line != line.upper() or not line.isascii():
            raise MacroSyntaxError(f"not in capitals: {line}")
        comments = COMMENT.findall(line)
        code = COMMENT.sub("", line).strip()
        if "(" in code or ")" in code:
            raise MacroSyntaxError(f"brackets of a comment: {line}")
        self.comment = comments[0] if comments else ""
        found = re.match(r"N(\d+) ?", code)
        self.label = int(found[1]) if found else None
        self.code = code[found.end() :] if found else code


class _Call:
    """One call of a program, with its local variables."""

    def __init__(self, control: MacroControl, blocks: list[_Block], local: dict[int, Value]):
        self.control = control
        self.blocks = blocks
        self.local = local

    def run(self) -> None:
        at = 0
        for _ in range(100_000):
            if at >= len(self.blocks) or self.blocks[at].code in ("M99", "M30"):
                return
            at = self.step(at)
        raise AssertionError("the program does not end")

    def step(self, at: int) -> int:
        block = self.blocks[at]
        code = block.code
        if found := re.fullmatch(r"IF (\[.*\]) GOTO ?(\d+)", code):
            return self.labelled(int(found[2])) if self.holds(found[1]) else at + 1
        if found := re.fullmatch(r"GOTO ?(\d+)", code):
            return self.labelled(int(found[1]))
        if found := re.fullmatch(r"IF (\[.*\]) THEN (#.*)", code):
            if self.holds(found[1]):
                self.assign(found[2], "")
            return at + 1
        if found := re.fullmatch(r"WHILE (\[.*\]) DO([123])", code):
            end = self.line_of(f"END{found[2]}", at)
            return at + 1 if self.holds(found[1]) else end + 1
        if found := re.fullmatch(r"END([123])", code):
            starts = [i for i in range(at) if self.blocks[i].code.endswith(f" DO{found[1]}")]
            return starts[-1]
        if code.startswith("#"):
            self.assign(code, block.comment)
        elif code:
            self.words(code)
        return at + 1

    def line_of(self, code: str, after: int) -> int:
        return next(i for i, b in enumerate(self.blocks) if i > after and b.code == code)

    def labelled(self, number: int) -> int:
        (at,) = [i for i, block in enumerate(self.blocks) if block.label == number]
        return at

    def assign(self, code: str, comment: str) -> None:
        left, _, right = code.partition("=")
        reader = _Reader(left, self)
        reader.take("#")
        number = reader.variable_number()
        value = _Reader(right, self).whole()
        if number == 3000:
            assert value is not None
            assert 0 <= value <= 200
            assert 0 < len(comment) <= 26, comment
            raise MacroAlarm(int(value), comment)
        self.write(number, value)

    def words(self, code: str) -> None:
        found = re.findall(r"([A-Z])(#\d+|\[[^A-Z]*\]|-?[\d.]+)(?: |$|(?=[A-Z]))", code)
        if "".join(letter + value for letter, value in found) != code.replace(" ", ""):
            raise MacroSyntaxError(f"not a block of a macro: {code}")
        words = [(letter, _Reader(value, self).whole() or 0.0) for letter, value in found]
        for code in (value for letter, value in words if letter == "G"):
            for modal, codes in MODES.items():
                if code in codes:
                    self.control.variables[modal] = code
        if ("G", 65.0) not in words:
            for value in (value for letter, value in words if letter == "F"):
                self.control.variables[4109] = value
        if ("G", 65.0) in words:
            order = [letter for letter, _ in found if letter in "IJK"]
            assert order == sorted(order), code
            for letter, value in found:
                assert "." in value or letter not in "IJKDRF", f"no decimal point: {code}"
            arguments = dict(words)
            number = int(arguments.pop("P"))
            del arguments["G"]
            self.control.run(number, arguments)
        elif self.control.move is not None:
            self.control.move(self.control, words)
        else:
            raise MacroSyntaxError(f"not a block of a macro: {code}")

    def read(self, number: int) -> Value:
        if number == 0:
            return None
        store = self.local if number <= 33 else self.control.variables
        return store.get(self.control.own(number))

    def write(self, number: int, value: Value) -> None:
        if not (1 <= number <= 33 or 100 <= number <= 999 or 10_000 <= number <= 10_999):
            raise MacroSyntaxError(f"#{number} cannot be written")
        store = self.local if number <= 33 else self.control.variables
        store[self.control.own(number)] = value

    def holds(self, condition: str) -> bool:
        reader = _Reader(condition, self)
        reader.open()
        left = reader.sum()
        compare = reader.name()
        if compare not in COMPARISONS:
            raise MacroSyntaxError(condition)
        right = reader.sum()
        reader.close()
        reader.end()
        if compare in ("EQ", "NE") and (left is None) != (right is None):
            return compare == "NE"
        return COMPARISONS[compare](left or 0.0, right or 0.0)


class _Reader:
    """Reads an expression from left to right."""

    def __init__(self, text: str, call: _Call) -> None:
        self.tokens: list[str] = []
        at = 0
        while at < len(text):
            found = TOKEN.match(text, at)
            if found is None:
                raise MacroSyntaxError(f"'{text[at:]}' in '{text}'")
            if found.lastgroup == "number" and sum(c.isdigit() for c in found[0]) > DIGITS:
                raise MacroSyntaxError(f"{found[0]} has more than {DIGITS} digits")
            if found.lastgroup != "space":
                self.tokens.append(found[0])
            at = found.end()
        self.text = text
        self.call = call
        self.depth = 0

    def peek(self) -> str:
        return self.tokens[0] if self.tokens else ""

    def take(self, expected: str = "") -> str:
        if not self.tokens or (expected and self.tokens[0] != expected):
            raise MacroSyntaxError(f"'{expected}' is missing in '{self.text}'")
        return self.tokens.pop(0)

    def name(self) -> str:
        return self.take()

    def open(self) -> None:
        self.take("[")
        self.depth += 1
        if self.depth > DEEPEST:
            raise MacroSyntaxError(f"brackets nest too deep in '{self.text}'")

    def close(self) -> None:
        self.take("]")
        self.depth -= 1

    def end(self) -> None:
        if self.tokens:
            raise MacroSyntaxError(f"'{' '.join(self.tokens)}' at the end of '{self.text}'")

    def whole(self) -> Value:
        value = self.sum()
        self.end()
        return value

    def variable_number(self) -> int:
        if self.peek() == "[":
            self.open()
            number = self.sum() or 0.0
            self.close()
        else:
            number = float(self.take())
        assert abs(number - round(number)) < 1e-6
        return round(number)

    def sum(self) -> Value:
        value = self.product()
        while self.peek() in ("+", "-"):
            sign = self.take()
            other = self.product() or 0.0
            value = (value or 0.0) + (other if sign == "+" else -other)
        return value

    def product(self) -> Value:
        value = self.factor()
        while self.peek() in ("*", "/"):
            sign = self.take()
            other = self.factor() or 0.0
            value = (value or 0.0) * other if sign == "*" else (value or 0.0) / other
        return value

    def factor(self) -> Value:
        token = self.take()
        if token == "-":
            return -(self.factor() or 0.0)
        if token == "#":
            return self.call.read(self.variable_number())
        if token == "[":
            self.tokens.insert(0, token)
            return self.bracket()
        if token.isalpha():
            return self.function(token)
        if not token[-1].isdigit() and not token[0].isdigit():
            raise MacroSyntaxError(f"'{token}' in '{self.text}'")
        return float(token)

    def bracket(self) -> Value:
        self.open()
        value = self.sum()
        self.close()
        return value

    def function(self, name: str) -> float:
        value = self.bracket() or 0.0
        if name == "ATAN":
            if self.peek() != "/" or not self.call.control.two_value_atan:
                return math.degrees(math.atan(value))
            self.take("/")
            other = self.bracket() or 0.0
            angle = math.degrees(math.atan2(value, other))
            return angle if self.call.control.signed_atan else angle % 360.0
        functions: dict[str, Callable[[float], float]] = {
            "SQRT": math.sqrt, "ABS": abs, "FIX": math.trunc,
            "SIN": lambda a: math.sin(math.radians(a)), "COS": lambda a: math.cos(math.radians(a)),
        }  # fmt: skip
        if name not in functions:
            raise MacroSyntaxError(f"{name} is not a function of all controls")
        return float(functions[name](value))
