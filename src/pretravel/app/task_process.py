"""A task in a process of its own, which can be killed, and which ends with the server."""

from __future__ import annotations

import contextlib
import importlib
import json
import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

from pretravel.base import PretravelError, module_folders

_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv.pop(1)); "
    "from pretravel.app.task_process import main; main()"
)
"""The program of the process; isolated (-I), it takes the folders of modules as its argument."""
_STAGE, _WARNING, _RESULT, _FAULT, _FLAW = "stage", "warning", "result", "fault", "flaw"
NO_MEMORY = "there is not enough memory for this; use fewer directions or touches"


class FlawError(Exception):
    """What is no fault of the user; the text is a traceback, for the terminal."""


class TaskProcess:
    """A process that computes one task.

    Parameters
    ----------
    compute : callable
        A function of a module.
    settings : mapping
    files : mapping of str to tuple of Path
    results : mapping of str to value
        See `project.Inputs`.
    """

    def __init__(
        self,
        compute: Callable[..., Any],
        settings: Mapping[str, Any],
        files: Mapping[str, tuple[Path, ...]],
        results: Mapping[str, Any],
    ) -> None:
        command = [sys.executable, "-I", "-c", _START, json.dumps(module_folders())]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # its own children, such as the CAD kernel, end with it
        )
        inputs = (dict(settings), dict(files), dict(results))
        self._order = (compute.__module__, compute.__qualname__, *inputs)

    def kill(self) -> None:
        """End the process and its children at once."""
        if os.name == "posix":
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()

    def result(self, stage: Callable[[str], None], warning: Callable[[str], None]) -> Any:
        """Wait for the result; `stage` and `warning` are called with what the library says.

        Raises
        ------
        PretravelError
            As the task raised it; or the process was killed.
        FlawError
            Another exception.
        """
        answers, orders = self._process.stdout, self._process.stdin
        assert answers is not None
        assert orders is not None
        with self._process, answers, orders:
            try:
                # Left open: its end tells the process that the server is gone.
                pickle.dump(self._order, orders)
                orders.flush()
                while True:
                    kind, content = pickle.load(answers)
                    if kind == _RESULT:
                        return content
                    if kind == _FAULT:
                        raise PretravelError(content[0], inputs=content[1])
                    if kind == _FLAW:
                        raise FlawError(content)
                    (stage if kind == _STAGE else warning)(content)
            except (EOFError, OSError, pickle.UnpicklingError) as error:
                raise PretravelError(
                    "the computation ended without a result: it was cancelled, or the memory of "
                    "this computer was used up. Use a coarser mesh or fewer directions"
                ) from error
            finally:
                self.kill()


def main() -> None:
    """Compute the task that comes on the standard input; the program of the process."""
    orders = sys.stdin.buffer
    module, name, *inputs = pickle.load(orders)
    # What a library prints must not come between the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    threading.Thread(target=_end_with_server, args=(orders,), daemon=True).start()

    logger = logging.getLogger("pretravel")
    logger.addHandler(_Stages(answers))
    logger.setLevel(logging.INFO)
    warnings.simplefilter("always", UserWarning)
    warnings.showwarning = lambda message, *_, **__: _answer(answers, _WARNING, str(message))
    _answer(answers, *_computed(module, name, inputs))
    os._exit(0)  # the thread waits for the server


def _computed(module: str, name: str, inputs: list[Any]) -> tuple[str, Any]:
    from pretravel.app.project import Inputs

    try:
        compute = getattr(importlib.import_module(module), name)
        result = compute(Inputs(*inputs))
        pickle.dumps(result)
    except PretravelError as error:
        return _FAULT, (str(error), error.inputs)
    except MemoryError:
        return _FAULT, (NO_MEMORY, ())
    except Exception:
        return _FLAW, traceback.format_exc()
    return _RESULT, result


def _answer(answers: IO[bytes], kind: str, content: Any) -> None:
    pickle.dump((kind, content), answers, protocol=pickle.HIGHEST_PROTOCOL)
    answers.flush()


def _end_with_server(orders: IO[bytes]) -> None:
    orders.read()
    if os.name == "posix":
        os.killpg(os.getpgid(0), signal.SIGKILL)
    os._exit(1)


class _Stages(logging.Handler):
    """Sends the log messages of long work to the server."""

    def __init__(self, answers: IO[bytes]) -> None:
        super().__init__(logging.INFO)
        self._answers = answers

    def emit(self, record: logging.LogRecord) -> None:
        """Send a stage."""
        _answer(self._answers, _STAGE, record.getMessage())
