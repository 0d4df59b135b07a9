"""Values in G-code: numbers, parameters, functions, expressions in brackets.

A value is compiled once to a function of the parameters, and evaluated often. The text comes
without blanks and in lower case, as LinuxCNC reads it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Protocol

from tests.support.machine_model.errors import StopError


class Values(Protocol):
    """What an expression reads."""

    equal: float

    def number(self, index: int) -> float: ...

    def named(self, name: str) -> float: ...

    def exists(self, name: str) -> bool: ...


Value = Callable[[Values], float]

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)")
_NAME = re.compile(r"<([^<>]*)>")
_FUNCTIONS = ("abs", "acos", "asin", "atan", "cos", "exists", "exp", "fix", "fup", "ln", "round",
              "sin", "sqrt", "tan")  # fmt: skip
# The deeper, the earlier; within a line from left to right.
_PRECEDENCE = {
    "**": 5, "*": 4, "/": 4, "mod": 4, "+": 3, "-": 3,
    "eq": 2, "ne": 2, "gt": 2, "ge": 2, "lt": 2, "le": 2, "and": 1, "or": 1, "xor": 1,
}  # fmt: skip
_OPERATIONS = ("**", "mod", "and", "xor", "or", "eq", "ne", "gt", "ge", "lt", "le",
               "+", "-", "*", "/")  # fmt: skip


class Reader:
    """A place in the text of a line."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0

    def done(self) -> bool:
        return self.at >= len(self.text)

    def next(self) -> str:
        return self.text[self.at : self.at + 1]

    def take(self, wanted: str) -> bool:
        """Step over a text, if it is next."""
        if self.text.startswith(wanted, self.at):
            self.at += len(wanted)
            return True
        return False

    def value(self) -> Value:
        """The value that is next."""
        sign = self.next()
        after = self.text[self.at + 1 : self.at + 2]
        if sign in ("+", "-") and after and not (after.isdigit() or after == "."):
            self.at += 1
            inner = self.value()
            return inner if sign == "+" else lambda p: -inner(p)
        if sign == "[":
            return _finite(self.expression())
        if sign == "#":
            return _finite(self.parameter())
        for name in _FUNCTIONS:
            if self.text.startswith(name, self.at):
                self.at += len(name)
                return _finite(self.function(name))
        found = _NUMBER.match(self.text, self.at)
        if found is None:
            if self.done():
                raise StopError("No characters found in reading real value")
            raise StopError(
                f"Bad number format (conversion failed) parsing '{self.text[self.at :]}'"
            )
        self.at = found.end()
        constant = float(found[0])
        return lambda p: constant

    def name(self) -> str:
        """A name in angle brackets."""
        found = _NAME.match(self.text, self.at)
        if found is None:
            raise StopError("Named parameter not terminated")
        self.at = found.end()
        return found[1]

    def parameter(self) -> Value:
        """The value of a parameter, from its sign # on."""
        self.take("#")
        if self.next() == "<":
            name = self.name()
            return lambda p: p.named(name)
        if (found := re.compile(r"\d+").match(self.text, self.at)) is not None:
            self.at = found.end()
            fixed = int(found[0])
            return lambda p: p.number(fixed)
        index = self.value()
        return lambda p: p.number(whole(index(p)))

    def function(self, name: str) -> Value:
        """The value of a function, from after its name on."""
        if self.next() != "[":
            raise StopError("Left bracket missing after unary operation name")
        if name == "exists":
            self.take("[#")
            asked = self.name()
            if not self.take("]"):
                raise StopError("Unclosed expression")
            return lambda p: float(p.exists(asked))
        inner = self.expression()
        if name != "atan":
            return lambda p: _function(name, inner(p))
        if not self.take("/"):
            raise StopError("Slash missing after first atan argument")
        if self.next() != "[":
            raise StopError("Left bracket missing after slash with atan")
        below = self.expression()
        return lambda p: math.degrees(math.atan2(inner(p), below(p)))

    def expression(self) -> Value:
        """An expression, from its bracket on."""
        self.take("[")
        values, operations = [self.value()], [self.operation()]
        while operations[-1] != "]":
            values.append(self.value())
            operations.append(self.operation())
        return _combined(values, operations[:-1])

    def operation(self) -> str:
        if self.done():
            raise StopError("Unclosed expression")
        if self.take("]"):
            return "]"
        for name in _OPERATIONS:
            if self.take(name):
                return name
        raise StopError(f"Unknown operation: '{self.text[self.at :]}'")


def _combined(values: list[Value], operations: list[str]) -> Value:
    """Binary operations by precedence, equal ones from the left."""
    stack = [values[0]]
    waiting: list[str] = []
    for operation, value in zip(operations, values[1:], strict=True):
        while waiting and _PRECEDENCE[waiting[-1]] >= _PRECEDENCE[operation]:
            right, left = stack.pop(), stack.pop()
            stack.append(_binary(waiting.pop(), left, right))
        waiting.append(operation)
        stack.append(value)
    while waiting:
        right, left = stack.pop(), stack.pop()
        stack.append(_binary(waiting.pop(), left, right))
    return stack[0]


def _binary(name: str, left: Value, right: Value) -> Value:
    if name == "+":
        return lambda p: left(p) + right(p)
    if name == "-":
        return lambda p: left(p) - right(p)
    if name == "*":
        return lambda p: left(p) * right(p)
    return lambda p: _slow_binary(name, left(p), right(p), p.equal)


def _slow_binary(name: str, left: float, right: float, equal: float) -> float:
    if name == "/":
        if right == 0.0:
            raise StopError("Attempt to divide by zero")
        return left / right
    if name == "mod":
        # Never negative.
        rest = math.fmod(left, right) if right else math.nan
        return rest + abs(right) if rest < 0.0 else rest
    if name == "**":
        if left < 0.0 and right != math.floor(right):
            raise StopError("Attempt to raise negative to non integer power")
        return left**right if left or right >= 0.0 else math.inf
    same = abs(left - right) < equal
    return float(
        {
            "eq": same,
            "ne": not same,
            "gt": left > right,
            "lt": left < right,
            "ge": left >= right,
            "le": left <= right,
            "and": bool(left and right),
            "or": bool(left or right),
            "xor": bool(left) != bool(right),
        }[name]
    )


def _function(name: str, x: float) -> float:
    if name in ("acos", "asin") and not -1.0 <= x <= 1.0:
        raise StopError(f"Argument to {name} out of range")
    if name == "sqrt" and x < 0.0:
        raise StopError("Negative argument to sqrt")
    if name == "ln" and x <= 0.0:
        raise StopError("Zero or negative argument to ln")
    radians = math.radians(x)
    return {
        "abs": lambda: abs(x),
        "acos": lambda: math.degrees(math.acos(x)),
        "asin": lambda: math.degrees(math.asin(x)),
        "cos": lambda: math.cos(radians),
        "exp": lambda: math.exp(x),
        "fix": lambda: float(math.floor(x)),
        "fup": lambda: float(math.ceil(x)),
        "ln": lambda: math.log(x),
        # Halves go away from zero.
        "round": lambda: math.copysign(math.floor(abs(x) + 0.5), x),
        "sin": lambda: math.sin(radians),
        "sqrt": lambda: math.sqrt(x),
        "tan": lambda: math.tan(radians),
    }[name]()


def _finite(value: Value) -> Value:
    def checked(p: Values) -> float:
        result = value(p)
        if math.isfinite(result):
            return result
        what = "'not a number'" if math.isnan(result) else "'infinity'"
        raise StopError(f"Calculation resulted in {what}")

    return checked


def whole(value: float) -> int:
    """The integer that a value means."""
    near = math.floor(value)
    if value - near > 0.9999:
        return math.ceil(value)
    if value - near > 0.0001:
        raise StopError("Non integer value for integer")
    return near
