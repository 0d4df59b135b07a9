"""Single faults of a Python module, as changes of its text.

A fault is known by the function, the line before and the line after: it stays the same one when
lines move. What has no effect on a result is not changed: docstrings, messages and what builds an
error, annotations, decorators, assertions, numbers below 1e-6 (limits of rounding), and keywords
that state a type or a text's encoding.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

_OPERATORS: dict[type[ast.AST], tuple[str, tuple[str, ...]]] = {
    ast.Add: ("+", ("-",)),
    ast.Sub: ("-", ("+",)),
    ast.Mult: ("*", ("/",)),
    ast.Div: ("/", ("*",)),
    ast.Pow: ("**", ("*",)),
    ast.FloorDiv: ("//", ("/",)),
    ast.Mod: ("%", ("*",)),
    ast.BitAnd: ("&", ("|",)),
    ast.BitOr: ("|", ("&",)),
    ast.BitXor: ("^", ("&",)),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Lt: ("<", ("<=", ">=")),
    ast.LtE: ("<=", ("<", ">")),
    ast.Gt: (">", (">=", "<=")),
    ast.GtE: (">=", (">", "<")),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
    ast.And: ("and", ("or",)),
    ast.Or: ("or", ("and",)),
}
_PAIRS = (
    "min max", "minimum maximum", "argmin argmax", "nanmin nanmax", "any all", "sin cos",
    "arcsin arccos", "asin acos", "floor ceil", "radians degrees", "deg2rad rad2deg",
    "from_deg to_deg", "mean sum", "isfinite isnan", "union1d intersect1d",
)  # fmt: skip
_SWAPPED = {a: b for pair in _PAIRS for a, b in (pair.split(), pair.split()[::-1])}
_UNARY = {ast.USub: 1, ast.Not: 3, ast.Invert: 1}
_PRESENTATION = {"inputs", "dtype", "encoding", "stacklevel", "category", "file", "strict"}
"""Keywords that are not dropped, nor their values changed."""
_ROUNDING = 1e-6
_QUIET_CALLS = re.compile(r"(^|\.)(warn|debug|info|cast|TypeVar|\w*Error|\w*Warning)$")
Functions = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Fault:
    """A change of the text of a module.

    Attributes
    ----------
    module : str
        Path in the package: ``prediction/seats.py``.
    function : str
        Empty for the module's own statements.
    before, after : str
        The lines that change, without their indentation.
    kind : str
    lines : tuple of int
        First and last line of the statement, or of its head: who executes them executes the fault.
    place : tuple of int
        First and last byte of the text that is replaced.
    replacement : bytes
    tests : tuple of str
        Files or folders of tests that are to be tried first.
    """

    module: str
    function: str
    before: str
    after: str
    kind: str
    lines: tuple[int, int]
    place: tuple[int, int]
    replacement: bytes
    tests: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[str, str, str, str]:
        return self.module, self.function, self.before, self.after

    def rank(self, seed: str) -> str:
        """A number by chance, the same one wherever the line moves to."""
        return hashlib.sha256("\n".join((seed, *self.key)).encode()).hexdigest()

    def in_text(self, content: bytes) -> bytes:
        """The module with this fault."""
        return content[: self.place[0]] + self.replacement + content[self.place[1] :]

    def changes(self, content: bytes) -> bool:
        """Whether the module with this fault is Python, and another program."""
        try:
            return ast.dump(ast.parse(self.in_text(content))) != ast.dump(ast.parse(content))
        except SyntaxError:
            return False

    def __str__(self) -> str:
        place = f"{self.module}:{self.lines[0]} {self.function} [{self.kind}]"
        return f"{place}\n    - {self.before}\n    + {self.after}"


@dataclass(frozen=True)
class _Change:
    kind: str
    start: int
    end: int
    text: str


def faults_of(module: str, content: bytes) -> list[Fault]:
    """All faults of a module, in the order of its text.

    Parameters
    ----------
    module : str
        Its path in the package.
    content : bytes

    >>> for fault in faults_of("a.py", b"def f(x):\\n    return -x.T < 2"):
    ...     print(fault.kind, "|", fault.after)
    minus dropped | return x.T < 2
    transpose dropped | return -x < 2
    < to <= | return -x.T <= 2
    < to >= | return -x.T >= 2
    number | return -x.T < 3
    """
    return list(_Walk(module, content).faults())


class _Walk:
    def __init__(self, module: str, content: bytes) -> None:
        self._module, self._content = module, content
        self._tree = ast.parse(content)
        self._starts = [0]
        for line in content.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))

    def faults(self) -> Iterator[Fault]:
        seen = set()
        for function, statement, bound in _statements(self._tree.body, ""):
            changes = list(self._of_statement(statement, bound))
            for node in _nodes(statement):
                changes += self._of_node(node)
            for change in sorted(changes, key=lambda c: c.start):
                fault = self._fault(function, statement, change)
                if fault.key not in seen:
                    seen.add(fault.key)
                    yield fault

    def _fault(self, function: str, statement: ast.stmt, change: _Change) -> Fault:
        first = self._content.rfind(b"\n", 0, change.start) + 1
        last = self._content.find(b"\n", change.end)
        last = len(self._content) if last < 0 else last
        new = self._content[first : change.start] + change.text.encode()
        new += self._content[change.end : last]
        return Fault(
            self._module, function,
            _in_one(self._content[first:last]), _in_one(new), change.kind,
            _head(statement), (change.start, change.end), change.text.encode(),
        )  # fmt: skip

    def _at(self, node: ast.AST) -> tuple[int, int]:
        assert isinstance(node, ast.expr | ast.stmt | ast.keyword)
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return (
            self._starts[node.lineno - 1] + node.col_offset,
            self._starts[node.end_lineno - 1] + node.end_col_offset,
        )

    def _text(self, node: ast.AST) -> str:
        start, end = self._at(node)
        return self._content[start:end].decode()

    def _of_statement(self, statement: ast.stmt, bound: set[str]) -> Iterator[_Change]:
        """The statement left out, or its condition turned."""
        start, end = self._at(statement)
        if _can_be_left_out(statement, bound):
            yield _Change("statement left out", start, end, "pass")
        if isinstance(statement, ast.If) and not _is_type_checking(statement):
            if all(isinstance(s, ast.Raise) for s in statement.body) and not statement.orelse:
                yield _Change("check left out", *self._at(statement.test), "False")
            elif not isinstance(statement.test, ast.Compare | ast.BoolOp | ast.UnaryOp):
                yield self._turned(statement.test)

    def _turned(self, test: ast.expr) -> _Change:
        return _Change("condition turned", *self._at(test), f"not ({self._text(test)})")

    def _of_node(self, node: ast.AST) -> Iterable[_Change]:
        if isinstance(node, ast.BinOp):
            return self._operators([node.left, node.right], [node.op])
        if isinstance(node, ast.AugAssign):
            return self._operators([node.target, node.value], [node.op])
        if isinstance(node, ast.Compare):
            return self._operators([node.left, *node.comparators], node.ops)
        if isinstance(node, ast.BoolOp):
            return self._operators(node.values, [node.op] * (len(node.values) - 1))
        if isinstance(node, ast.UnaryOp):
            return self._unary(node)
        if isinstance(node, ast.Constant):
            return self._constant(node)
        if isinstance(node, ast.Attribute) and node.attr == "T":
            return [_Change("transpose dropped", self._at(node.value)[1], self._at(node)[1], "")]
        if isinstance(node, ast.Call):
            return self._call(node)
        if isinstance(node, ast.Slice):
            return self._slice(node)
        if isinstance(node, ast.IfExp):
            test = node.test
            if not isinstance(test, ast.Compare | ast.BoolOp | ast.UnaryOp):
                return [self._turned(test)]
        return []

    def _operators(
        self, operands: list[ast.expr], operators: Iterable[ast.AST]
    ) -> Iterator[_Change]:
        for left, right, operator in zip(operands, operands[1:], operators, strict=False):
            if type(operator) not in _OPERATORS:
                continue
            sign, others = _OPERATORS[type(operator)]
            start, end = self._at(left)[1], self._at(right)[0]
            pattern = rb"\s+".join(re.escape(p.encode()) for p in sign.split())
            # Comments between operands may contain the sign.
            between = re.sub(rb"#[^\n]*", lambda m: b" " * len(m[0]), self._content[start:end])
            found = re.search(pattern, between)
            if found:
                for other in others:
                    yield _Change(
                        f"{sign} to {other}", start + found.start(), start + found.end(), other
                    )

    def _unary(self, node: ast.UnaryOp) -> Iterator[_Change]:
        size = _UNARY.get(type(node.op))
        if size is not None:
            start = self._at(node)[0]
            name = {1: "minus dropped", 3: "not dropped"}[size]
            name = "not dropped" if isinstance(node.op, ast.Invert) else name
            yield _Change(name, start, start + size, "")

    def _constant(self, node: ast.Constant) -> Iterator[_Change]:
        value = node.value
        if isinstance(value, bool):
            yield _Change("truth", *self._at(node), str(not value))
        elif isinstance(value, int):
            yield _Change("number", *self._at(node), str(value + 1))
        elif isinstance(value, float) and not 0.0 < abs(value) < _ROUNDING:
            other = 1.0 if value == 0.0 else 0.25 if value == 0.5 else 2.0 * value
            yield _Change("number", *self._at(node), repr(other))

    def _call(self, node: ast.Call) -> Iterator[_Change]:
        name = self._text(node.func).rpartition(".")[2]
        end = self._at(node.func)[1]
        if name in _SWAPPED:
            other = _SWAPPED[name]
            yield _Change(f"{name} to {other}", end - len(name.encode()), end, other)
        # A value type without one of its fields does not work at all.
        if not name.lstrip("_")[:1].isupper() and name != "field":
            for keyword in node.keywords:
                if keyword.arg is not None and keyword.arg not in _PRESENTATION:
                    yield self._without(keyword)

    def _without(self, keyword: ast.keyword) -> _Change:
        start, end = self._at(keyword)
        comma = re.match(rb"\s*,[ \t]*", self._content[end:])
        if comma:
            end += comma.end()
        else:
            before = re.search(rb",\s*$", self._content[:start])
            start = before.start() if before else start
        return _Change(f"keyword {keyword.arg} dropped", start, end, "")

    def _slice(self, node: ast.Slice) -> Iterator[_Change]:
        if node.upper is not None and not isinstance(node.upper, ast.Constant):
            text = f"({self._text(node.upper)}) - 1"
            yield _Change("slice ends before", *self._at(node.upper), text)
        if node.lower is not None and not isinstance(node.lower, ast.Constant):
            text = f"({self._text(node.lower)}) + 1"
            yield _Change("slice begins after", *self._at(node.lower), text)
        if node.lower is None and node.upper is not None:
            start, end = self._at(node)
            yield _Change("slice begins after", start, end, f"1{self._text(node)}")


def _in_one(lines: bytes) -> str:
    return " ".join(lines.decode().split())


def _statements(body: list[ast.stmt], function: str) -> Iterator[tuple[str, ast.stmt, set[str]]]:
    """Statements with their function, and the names that are bound before them there."""
    bound: set[str] = set()
    yield from _in_body(body, function, bound)


def _in_body(
    body: list[ast.stmt], function: str, bound: set[str]
) -> Iterator[tuple[str, ast.stmt, set[str]]]:
    for statement in body:
        if isinstance(statement, Functions | ast.ClassDef):
            inner = f"{function}.{statement.name}".lstrip(".")
            names: set[str] = set()
            if isinstance(statement, Functions):
                names = {a.arg for a in ast.walk(statement.args) if isinstance(a, ast.arg)}
                yield function, statement, set()
            yield from _in_body(statement.body, inner, names)
            continue
        if isinstance(statement, ast.If) and _is_type_checking(statement):
            continue
        yield function, statement, set(bound)
        bound |= {
            n.id for n in ast.walk(statement)
            if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }  # fmt: skip
        for name in ("body", "orelse", "finalbody"):
            yield from _in_body(getattr(statement, name, []), function, bound)
        for handler in getattr(statement, "handlers", []):
            yield from _in_body(handler.body, function, bound)
        for case in getattr(statement, "cases", []):
            yield from _in_body(case.body, function, bound)


def _is_type_checking(statement: ast.If) -> bool:
    return isinstance(statement.test, ast.Name) and statement.test.id == "TYPE_CHECKING"


def _head(statement: ast.stmt) -> tuple[int, int]:
    """Lines of a statement, without those of the statements within it; all of a function."""
    if isinstance(statement, Functions):
        return statement.lineno, statement.end_lineno or statement.lineno
    inner = getattr(statement, "body", None) or getattr(statement, "cases", None)
    if not inner:
        return statement.lineno, statement.end_lineno or statement.lineno
    first = inner[0].pattern if isinstance(inner[0], ast.match_case) else inner[0]
    return statement.lineno, max(statement.lineno, first.lineno - 1)


def _can_be_left_out(statement: ast.stmt, bound: set[str]) -> bool:
    """Without it the function still runs: what it binds is bound before."""
    if isinstance(statement, ast.AugAssign | ast.Continue | ast.Break):
        return True
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Call) and not _is_quiet(statement.value)
    if isinstance(statement, ast.Assign):
        targets = [n for t in statement.targets for n in ast.walk(t) if isinstance(n, ast.expr)]
        stored = [n for n in targets if isinstance(getattr(n, "ctx", None), ast.Store)]
        names = {n.id for n in stored if isinstance(n, ast.Name)}
        return names <= bound and not _is_text(statement.value)
    return False


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def _is_quiet(node: ast.AST) -> bool:
    """Warns, or makes an error."""
    return isinstance(node, ast.Call) and bool(_QUIET_CALLS.search(ast.unparse(node.func)))


def _nodes(statement: ast.stmt) -> Iterator[ast.AST]:
    """Nodes of a statement that have an effect on results, without the statements within it."""
    if isinstance(statement, ast.Raise | ast.Assert | ast.Import | ast.ImportFrom):
        return
    if isinstance(statement, Functions):
        waiting: list[ast.AST] = [*statement.args.defaults]
        waiting += [d for d in statement.args.kw_defaults if d is not None]
    else:
        waiting = [statement]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.JoinedStr) or _is_quiet(node):
            continue
        if isinstance(node, ast.AnnAssign):
            waiting += [node.value] if node.value is not None else []
            continue
        if isinstance(node, ast.Subscript) and ast.unparse(node.value).endswith("Literal"):
            continue
        if isinstance(node, ast.keyword) and node.arg in _PRESENTATION:
            continue
        yield node
        waiting += [
            child for child in ast.iter_child_nodes(node)
            if not isinstance(child, ast.stmt | ast.match_case | ast.ExceptHandler)
        ]  # fmt: skip
