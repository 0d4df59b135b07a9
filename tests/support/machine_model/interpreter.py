"""RS274/NGC as LinuxCNC 2.9 reads it: the flow of the lines, parameters, comments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.support.machine_model.blocks import Block, OWord
from tests.support.machine_model.commands import Commands
from tests.support.machine_model.control import Control
from tests.support.machine_model.errors import StopError
from tests.support.machine_model.expressions import whole
from tests.support.machine_model.modes import Modes
from tests.support.machine_model.program import Files, SourceFile, read_source

MOST_LINES = 3_000_000
"""A program that runs more lines is taken for an endless loop."""
DEEPEST = 10
"""Levels of subroutines that LinuxCNC has."""


@dataclass(eq=False)
class _Level:
    """A running subroutine, and where it was called from."""

    label: str
    source: SourceFile
    row: int
    arguments: dict[int, float]
    saved_modes: Modes | None
    restore_at_return: bool


class Interpreter:
    """Runs a program on a control.

    Parameters
    ----------
    control : Control
        The state of the control, with what its moves do.
    text : str
        The program.
    subroutines : mapping of str to str, or Path
        Texts by file name, or the folder of the subroutines.
    """

    def __init__(
        self,
        control: Control,
        text: str,
        subroutines: Mapping[str, str] | Path | None = None,
    ) -> None:
        self.control = control
        self.files = Files(text, subroutines)
        self.source = self.files.main
        self.row = 0
        self.levels: list[_Level] = []
        self.repeats: dict[tuple[int, str, int], int] = {}
        self.commands = Commands(control)
        self.executed = 0
        self.left_a_loop = False
        values = control.parameters.live
        values["_value"] = lambda: control.returned
        values["_value_returned"] = lambda: float(control.value_returned)
        values["_call_level"] = lambda: float(len(self.levels))
        values["_line"] = lambda: float(self.row)

    def run(self) -> None:
        """Run to the end of the program.

        Raises
        ------
        StopError
            The control stopped.
        """
        percent = self.source.blocks[:1] and self.source.blocks[0].percent
        while True:
            if self.row >= len(self.source.blocks):
                raise StopError("File ended with no percent sign or program end")
            block = self.source.blocks[self.row]
            self.row += 1
            self.executed += 1
            if self.executed > MOST_LINES:
                raise StopError(f"the model ran {MOST_LINES} lines: an endless loop")
            if block.percent:
                if percent and self.row > 1:
                    return
                continue
            self.control.line = self.row
            self.control.file = self.source.name
            if block.error:
                raise StopError(block.error)
            if block.o_word is not None:
                self._control_flow(block.o_word)
            elif self._execute(block):
                return

    def _execute(self, block: Block) -> bool:
        """One line without O-words; true where the program ends."""
        parameters = self.control.parameters
        words = {letter: value(parameters) for letter, value in block.words.items()}
        g_codes = [value(parameters) for value in block.g_codes]
        m_codes = [value(parameters) for value in block.m_codes]
        self._set_parameters(block)
        if block.comment is not None:
            self._comment(block.comment)
        if words or g_codes or m_codes:
            self.commands.level = len(self.levels)
            return self.commands.execute(words, g_codes, m_codes)
        return False

    def _set_parameters(self, block: Block) -> None:
        """Values first, then settings: a line sees what was before it.

        A new name is there, as zero, from its own setting on.
        """
        parameters = self.control.parameters
        found = []
        for s in block.settings:
            if s.name and not parameters.exists(s.name):
                parameters.set_named(s.name, 0.0)
            index = whole(s.index(parameters)) if s.index else 0
            found.append((s.name, index, s.value(parameters)))
        for name, index, value in found:
            if name:
                parameters.set_named(name, value)
            else:
                parameters.set_number(index, value)

    def _comment(self, comment: str) -> None:
        text = comment.lstrip()
        kind, comma, rest = text.partition(",")
        kind = kind.lower()
        control, outputs = self.control, self.control.outputs
        if not comma:
            if text.lower() == "logclose":
                outputs.close_log()
            elif text.startswith("PROBEOPEN"):
                outputs.open_probe_file(text[len("PROBEOPEN") :].strip())
            elif text.startswith("PROBECLOSE"):
                outputs.close_probe_file()
        elif kind == "msg":
            outputs.messages.append(rest)
        elif kind == "debug":
            outputs.messages.append(control.parameters.expanded(rest))
        elif kind == "print":
            outputs.printed.append(control.parameters.expanded(rest))
        elif kind == "log":
            outputs.log(control.parameters.expanded(rest))
        elif kind in ("logopen", "logappend"):
            outputs.open_log(rest, append=kind == "logappend")
        elif kind == "abort":
            raise StopError(control.parameters.expanded(rest), own=True)

    def _control_flow(self, word: OWord) -> None:
        parameters = self.control.parameters
        label = word.label
        if word.computed is not None:
            label = str(whole(word.computed(parameters)))
        if word.keyword == "sub":
            self._skip_definition(label)
        elif word.keyword == "call":
            self._call(label, [value(parameters) for value in word.values])
        elif word.keyword in ("return", "endsub"):
            values = [value(parameters) for value in word.values]
            self._return(values[0] if values else None)
        else:
            self._branch(word)

    def _skip_definition(self, label: str) -> None:
        for row in range(self.row, len(self.source.blocks)):
            word = self.source.blocks[row].o_word
            if word is not None and word.keyword == "endsub" and word.label == label:
                self.row = row + 1
                return
        raise StopError(f"EOF in file:{self.source.name} seeking o-word: o<{label}>")

    def _call(self, label: str, values: list[float]) -> None:
        if len(self.levels) + 1 >= DEEPEST:
            raise StopError("Too many subroutine levels")
        written = self.control.outputs.logs.get(f"{label}.ngc")
        if written is not None:
            source = read_source(f"{label}.ngc", "\n".join(written))
            row = source.subs[label]
        else:
            source, row = self.files.find(label, self.source)
        parameters = self.control.parameters
        kept = {n: parameters.numbered.get(n, 0.0) for n in range(1, 31)}
        # Arguments that are not given are zero.
        parameters.numbered.update(dict.fromkeys(range(1, 31), 0.0))
        parameters.numbered.update(enumerate(values, start=1))
        parameters.locals.append({})
        state = self.commands
        self.levels.append(
            _Level(label, self.source, self.row, kept, state.saved, state.restore_at_return)
        )
        state.saved, state.restore_at_return = None, False
        self.source, self.row = source, row + 1
        self.control.returned, self.control.value_returned = 0.0, False

    def _return(self, value: float | None) -> None:
        if not self.levels:
            raise StopError("not in a subroutine definition")
        level = self.levels.pop()
        parameters = self.control.parameters
        self.control.value_returned = value is not None
        self.control.returned = 0.0 if value is None else value
        parameters.numbered.update(level.arguments)
        parameters.locals.pop()
        state = self.commands
        if state.restore_at_return and state.saved is not None:
            state.restore()
        state.saved, state.restore_at_return = level.saved_modes, level.restore_at_return
        self.source, self.row = level.source, level.row

    def _branch(self, word: OWord) -> None:
        """If, while, repeat, do, break and continue."""
        here = self.row - 1
        rows = self.source.chains.get(here)
        if rows is None or rows[0] < 0:
            raise StopError(
                f"{here + 1}: O-word label: '{word.label}' has no partner, or occurs twice"
            )
        blocks = self.source.blocks
        opening = blocks[rows[0]].o_word
        assert opening is not None
        parameters = self.control.parameters
        value = word.values[0](parameters) if word.values else 0.0
        if word.keyword == "if":
            if value == 0.0:
                self._next_branch(rows, here)
        elif word.keyword in ("elseif", "else"):
            # Reached from above: a branch was run.
            self.row = rows[-1] + 1
        elif word.keyword == "while":
            if opening.keyword == "do":
                # LinuxCNC leaves a do loop at once after the break of an earlier while loop.
                again = value != 0.0 and not self.left_a_loop
                self.row = rows[0] + 1 if again else self.row
                self.left_a_loop = False
            elif value == 0.0:
                self.row = rows[-1] + 1
        elif word.keyword == "repeat":
            self._repeat(rows, value)
        elif word.keyword in ("endwhile", "endrepeat"):
            self.row = rows[0]
        elif word.keyword == "break":
            self.row = rows[-1] + 1
            self.left_a_loop = opening.keyword == "while"
        elif word.keyword == "continue":
            if opening.keyword == "do":
                raise StopError(
                    "continue in a do loop: the model does not run it, because LinuxCNC 2.9.0 "
                    "leaves the loop instead, and counts the next repeat loop wrongly"
                )
            self.row = rows[0]

    def _next_branch(self, rows: tuple[int, ...], here: int) -> None:
        parameters = self.control.parameters
        for row in rows[rows.index(here) + 1 :]:
            word = self.source.blocks[row].o_word
            assert word is not None
            if word.keyword in ("else", "endif") or (
                word.keyword == "elseif" and word.values[0](parameters) != 0.0
            ):
                self.row = row + 1
                return

    def _repeat(self, rows: tuple[int, ...], value: float) -> None:
        key = (len(self.levels), self.source.name, rows[0])
        left = self.repeats.get(key)
        left = round(value) if left is None else left
        if left > 0:
            self.repeats[key] = left - 1
        else:
            self.repeats.pop(key, None)
            self.row = rows[-1] + 1
