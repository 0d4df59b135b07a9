"""Work that several forks of a process share, each with its own copy of the project."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, TypeVar

from tests.mutation.scratch import PROJECT, Scratch

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_processes(
    number: int,
    items: Sequence[Item],
    work: Callable[[Scratch, Item], Result],
    folder: Path,
    project: Path = PROJECT,
) -> Iterator[tuple[Item, Result]]:
    """Do work for each item, and yield what it returns as it comes.

    Parameters
    ----------
    number : int
        Of processes.
    items : sequence
        A process that is free takes the next one.
    work : callable
        Gets the copy of its process, and an item.
    folder : Path
        For the copies.
    project : Path
        What is copied.

    Raises
    ------
    RuntimeError
        A process ended before its work was done.
    """
    # Forks, so that the libraries are loaded once.
    forking = multiprocessing.get_context("fork")
    taken = forking.Value("i", 0)

    def do(copy: Path, connection: Connection) -> None:
        scratch = Scratch(copy, project)
        while True:
            with taken.get_lock():
                place = taken.value
                taken.value += 1
            if place >= len(items):
                break
            connection.send((place, work(scratch, items[place])))

    readers: list[Any] = []
    for copy in range(min(number, len(items))):
        reading, writing = forking.Pipe(duplex=False)
        forking.Process(target=do, args=(folder / str(copy), writing), daemon=False).start()
        writing.close()
        readers.append(reading)
    missing = set(range(len(items)))
    while readers:
        for reading in wait(readers):
            try:
                place, result = reading.recv()  # type: ignore[union-attr]
            except EOFError:
                readers.remove(reading)
                continue
            missing.discard(place)
            yield items[place], result
    if missing:
        raise RuntimeError(
            f"nothing was said of {', '.join(str(items[n]) for n in sorted(missing))}"
        )
