"""A small interpreter of the Siemens 840D language, for the files of `siemens_cycle`.

It runs data definitions, assignments, IF … ELSE … ENDIF, IF … GOTOF, GOTOB, FOR … ENDFOR, MSG,
SETAL, STOPRE, M0 and RET. An alarm of a cycle is shown, and the program goes on; at M0 it waits for
Start.
Everything must be defined before it is used; an INT takes the nearest integer; an index must be an
integer inside its array. Facts: public manuals and courses on SINUMERIK job planning.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field

TOKEN = re.compile(
    r"(?P<number>\d+\.?\d*|\.\d+)|(?P<name>\$?[A-Z][A-Z0-9_]*)|(?P<sign><>|<=|>=|==|[<>+\-*/(),\[\]])"
    r"|(?P<space> +)"
)
COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "==": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}
FUNCTIONS: dict[str, Callable[..., float]] = {
    "SQRT": math.sqrt,
    "ABS": abs,
    "TRUNC": math.trunc,
    "SIN": lambda angle: math.sin(math.radians(angle)),
    "COS": lambda angle: math.cos(math.radians(angle)),
    "ATAN2": lambda y, x: math.degrees(math.atan2(y, x)),
}


class SiemensAlarm(Exception):  # noqa: N818, an alarm is what the control calls it
    """What SETAL shows, when the program stands at M0 and nobody presses Start."""

    def __init__(self, number: int, text: str) -> None:
        super().__init__(f"{number} {text}")
        self.number = number
        self.text = text


class SiemensSyntaxError(Exception):
    """A line that the control would refuse."""


@dataclass
class Datum:
    """A variable: INT or REAL, one value or an array."""

    kind: str
    values: list[float]

    def write(self, index: int, value: float) -> None:
        if not 0 <= index < len(self.values):
            raise SiemensSyntaxError(f"index {index} of {len(self.values)}")
        self.values[index] = math.floor(value + 0.5) if self.kind == "INT" else value


@dataclass
class SiemensControl:
    """A control with user data and cycles.

    Attributes
    ----------
    group13 : int
        1 for G70 and 2 for G71.
    starts : int
        So often the operator presses Start after M0.
    alarms : list
        Those that are shown.
    """

    data: dict[str, Datum] = field(default_factory=dict)
    programs: dict[str, list[str]] = field(default_factory=dict)
    group13: int = 2
    starts: int = 0
    alarms: list[SiemensAlarm] = field(default_factory=list)

    def define(self, text: str) -> None:
        """Activate a file of definitions."""
        lines = _code(text)
        assert lines[-1] == "M17"
        for line in lines[:-1]:
            found = re.fullmatch(r"DEF CHAN (.*)", line)
            assert found, line
            _define(self.data, f"DEF {found[1]}")

    def load(self, text: str) -> None:
        """Store a program by the name in its PROC line, which comes first."""
        lines = _code(text)
        found = re.fullmatch(r"PROC ([A-Z0-9_]+)(\(.*\))?( SBLOF)?", lines[0])
        assert found, lines[0]
        assert text.startswith(lines[0])
        self.programs[found[1]] = lines

    def main(self, text: str, parameters: dict[int, float]) -> dict[int, float]:
        """Run lines of a main program with R parameters; return all R parameters."""
        local = {f"R{number}": Datum("REAL", [0.0]) for number in range(100)}
        for number, value in parameters.items():
            local[f"R{number}"].write(0, value)
        declared, *lines = _code(text)
        assert re.fullmatch(r"EXTERN [A-Z]+\(REAL,REAL,REAL\)", declared)
        _Cycle(self, local, lines).run()
        return {number: local[f"R{number}"].values[0] for number in range(100)}

    def run(self, name: str, *arguments: float) -> None:
        """Call a program."""
        head, *lines = self.programs[name]
        parameters = re.findall(r"REAL ([A-Z0-9_]+)", head)
        assert len(parameters) == len(arguments)
        local = {
            parameter: Datum("REAL", [value])
            for parameter, value in zip(parameters, arguments, strict=True)
        }
        assert not set(local) & set(self.data)
        while lines and lines[0].startswith("DEF "):
            _define(local, lines.pop(0))
        _Cycle(self, local, lines).run()


def _code(text: str) -> list[str]:
    assert text.isascii()
    lines = [re.sub(r' *;[^"]*$', "", line) for line in text.splitlines()]
    for line in lines:
        assert len(line) <= 250
    return [line for line in lines if line]


def _define(data: dict[str, Datum], line: str) -> None:
    found = re.fullmatch(r"DEF (REAL|INT) (.*)", line)
    if found is None:
        raise SiemensSyntaxError(line)
    for item in found[2].split(","):
        name, size = re.fullmatch(r"([A-Z][A-Z_][A-Z0-9_]*)(?:\[(\d+)\])?", item).groups()  # type: ignore[union-attr]
        assert len(name) <= 24
        assert name not in data
        data[name] = Datum(found[1], [0.0] * int(size or 1))


class _JumpError(Exception):
    """The program goes on at another line."""

    def __init__(self, line: int) -> None:
        super().__init__(line)
        self.line = line


class _Cycle:
    """One call of a program."""

    def __init__(self, control: SiemensControl, local: dict[str, Datum], lines: list[str]) -> None:
        self.control = control
        self.data = {**control.data, **local}
        self.lines = lines

    def run(self) -> None:
        at = 0
        for _ in range(1000):
            try:
                self.block(at, len(self.lines))
            except _JumpError as jump:
                at = jump.line
            else:
                return
        raise AssertionError("the program does not end")

    def jump(self, at: int, way: str, label: str) -> None:
        """Go forward or backward to a label, from outside of all structures to such a place."""
        (line,) = [i for i, text in enumerate(self.lines) if text == f"{label}:"]
        assert (line > at) == (way == "GOTOF")
        raise _JumpError(line)

    def block(self, at: int, end: int) -> bool:
        """Run lines; whether the program has returned."""
        while at < end:
            line = self.lines[at]
            if line == "RET":
                return True
            if found := re.fullmatch(r"(?:IF (.*) )?(GOTO[FB]) ([A-Z0-9_]{2,32})", line):
                if found[1] is None or self.holds(found[1]):
                    self.jump(at, found[2], found[3])
            elif line.startswith("IF "):
                stop = self.closing(at, "IF ", "ENDIF")
                middle = self.otherwise(at, stop)
                first, last = (at + 1, middle) if self.holds(line[3:]) else (middle + 1, stop)
                if self.block(first, last):
                    return True
                at = stop
            elif line.startswith("FOR "):
                stop = self.closing(at, "FOR ", "ENDFOR")
                found = re.fullmatch(r"FOR ([A-Z0-9_]+)=(.*) TO (.*)", line)
                assert found
                for value in range(int(self.value(found[2])), int(self.value(found[3])) + 1):
                    self.assign(found[1], float(value))
                    if self.block(at + 1, stop):
                        return True
                at = stop
            else:
                self.statement(line)
            at += 1
        return False

    def closing(self, at: int, opening: str, closing: str) -> int:
        depth = 0
        for i in range(at, len(self.lines)):
            depth += self.lines[i].startswith(opening) and " GOTO" not in self.lines[i]
            depth -= self.lines[i] == closing
            if depth == 0:
                return i
        raise SiemensSyntaxError(f"no {closing} for: {self.lines[at]}")

    def otherwise(self, at: int, stop: int) -> int:
        found = [i for i in range(at, stop) if self.lines[i] == "ELSE"]
        return found[0] if found else stop

    def statement(self, line: str) -> None:
        if found := re.fullmatch(r'SETAL\((\d+),"([^"]*)"\)', line):
            assert 65000 <= int(found[1]) <= 65499
            self.control.alarms.append(SiemensAlarm(int(found[1]), found[2]))
            return
        if line == "STOPRE" or re.fullmatch(r"[A-Z][A-Z0-9_]+:", line):
            return
        if line == "M0":
            if self.control.starts == 0:
                raise self.control.alarms[-1]
            self.control.starts -= 1
            return
        if re.fullmatch(r'MSG\("[^"]{1,120}"\)', line):
            return
        if found := re.fullmatch(r"([A-Z_]+)\((.*)\)", line):
            self.control.run(found[1], *(self.value(text) for text in found[2].split(",")))
            return
        left, equals, right = line.partition("=")
        if not equals:
            raise SiemensSyntaxError(line)
        self.assign(left, self.value(right))

    def assign(self, left: str, value: float) -> None:
        found = re.fullmatch(r"([A-Z0-9_]+)(?:\[(.*)\])?", left)
        if found is None or found[1] not in self.data:
            raise SiemensSyntaxError(f"{left} is not defined")
        index = self.value(found[2]) if found[2] else 0.0
        assert index == int(index)
        self.data[found[1]].write(int(index), value)

    def value(self, text: str) -> float:
        reader = _Reader(text, self)
        value = reader.sum()
        reader.end()
        return value

    def holds(self, text: str) -> bool:
        reader = _Reader(text, self)
        held = reader.condition()
        reader.end()
        return held


class _Reader:
    """Reads an expression from left to right."""

    def __init__(self, text: str, cycle: _Cycle) -> None:
        self.tokens: list[str] = []
        at = 0
        while at < len(text):
            found = TOKEN.match(text, at)
            if found is None:
                raise SiemensSyntaxError(f"'{text[at:]}' in '{text}'")
            if found.lastgroup != "space":
                self.tokens.append(found[0])
            at = found.end()
        self.text = text
        self.cycle = cycle

    def peek(self) -> str:
        return self.tokens[0] if self.tokens else ""

    def take(self, expected: str = "") -> str:
        if not self.tokens or (expected and self.tokens[0] != expected):
            raise SiemensSyntaxError(f"'{expected}' is missing in '{self.text}'")
        return self.tokens.pop(0)

    def end(self) -> None:
        if self.tokens:
            raise SiemensSyntaxError(f"'{' '.join(self.tokens)}' at the end of '{self.text}'")

    def condition(self) -> bool:
        held = self.comparison()
        while self.peek() in ("OR", "AND"):
            word = self.take()
            other = self.comparison()
            held = held or other if word == "OR" else held and other
        return held

    def comparison(self) -> bool:
        kept = list(self.tokens)
        if self.peek() == "(":
            self.take()
            try:
                held = self.condition()
                self.take(")")
            except SiemensSyntaxError:
                self.tokens = kept
            else:
                return held
        left = self.sum()
        compare = self.take()
        if compare not in COMPARISONS:
            raise SiemensSyntaxError(self.text)
        return COMPARISONS[compare](left, self.sum())

    def sum(self) -> float:
        value = self.product()
        while self.peek() in ("+", "-"):
            value = value + self.product() if self.take() == "+" else value - self.product()
        return value

    def product(self) -> float:
        value = self.factor()
        while self.peek() in ("*", "/"):
            value = value * self.factor() if self.take() == "*" else value / self.factor()
        return value

    def factor(self) -> float:
        token = self.take()
        if token == "-":
            return -self.factor()
        if token == "(":
            value = self.sum()
            self.take(")")
            return value
        if token in FUNCTIONS:
            self.take("(")
            arguments = [self.sum()]
            while self.peek() == ",":
                self.take()
                arguments.append(self.sum())
            self.take(")")
            return float(FUNCTIONS[token](*arguments))
        if token == "$P_GG":
            self.take("[")
            assert self.sum() == 13
            self.take("]")
            return float(self.cycle.control.group13)
        if token[0].isalpha():
            return self.variable(token)
        if not token[-1].isdigit() and not token[0].isdigit():
            raise SiemensSyntaxError(f"'{token}' in '{self.text}'")
        return float(token)

    def variable(self, name: str) -> float:
        if name not in self.cycle.data:
            raise SiemensSyntaxError(f"{name} is not defined")
        values = self.cycle.data[name].values
        index = 0.0
        if self.peek() == "[":
            self.take()
            index = self.sum()
            self.take("]")
        assert index == int(index)
        if not 0 <= index < len(values):
            raise SiemensSyntaxError(f"index {index} of {name}")
        return values[int(index)]
