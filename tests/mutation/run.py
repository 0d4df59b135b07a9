"""Put single faults into rooms: ``python -m tests.mutation.run prediction --number 30``.

The faults are drawn by chance from the seed. Each runs the tests that execute its line, near and
quick ones first, until one fails. ``docs/reliability.md`` has the figures and how they are made.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from platformdirs import user_cache_path

from tests.mutation.campaign import Verdict, failing_without_fault, try_fault
from tests.mutation.faults import Fault, faults_of
from tests.mutation.known_faults import named
from tests.mutation.line_map import LineMap, make_line_map
from tests.mutation.processes import in_processes
from tests.mutation.scratch import PROJECT, ROOMS, Scratch, load_libraries


def drawn(package: Path, room: str, number: int, seed: str) -> list[Fault]:
    """Some faults of a room; the same ones whatever moves or is added elsewhere."""
    found: list[Fault] = []
    contents = {
        path.relative_to(package).as_posix(): path.read_bytes()
        for path in sorted((package / room).rglob("*.py"))
    }
    every = [fault for module, content in contents.items() for fault in faults_of(module, content)]
    for fault in sorted(every, key=lambda f: f.rank(seed)):
        if len(found) == number:
            break
        if fault.changes(contents[fault.module]):
            found.append(fault)
    return found


def table(verdicts: Sequence[Verdict]) -> str:
    """The figures of each room."""
    lines = [
        "| room | faults | noticed | survived | share noticed |",
        "| --- | --- | --- | --- | --- |",
    ]
    rooms = [*dict.fromkeys(v.fault.module.partition("/")[0] for v in verdicts), ""]
    for room in rooms:
        of_room = [v for v in verdicts if v.fault.module.startswith(f"{room}/") or not room]
        killed = sum(bool(v.killer) for v in of_room)
        lines.append(
            f"| {room or 'all'} | {len(of_room)} | {killed} | {len(of_room) - killed} "
            f"| {100.0 * killed / max(len(of_room), 1):.0f} % |"
        )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rooms", nargs="*", help=f"all, or some of {', '.join(ROOMS)}")
    parser.add_argument("--number", type=int, default=30, help="faults of each room")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--patience", type=float, default=60.0, help="s of tests for each fault")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--named", action="store_true", help="the faults of named.toml too")
    parser.add_argument(
        "--only", default="", help="only faults with this text in their description"
    )
    parser.add_argument("--kept", type=Path, default=user_cache_path("pretravel-mutation"))
    parser.add_argument(
        "--results", type=Path, help="append each verdict to this file (JSON lines)"
    )
    parser.add_argument("--list", action="store_true", help="only list the faults")
    stated = parser.parse_args()
    if unknown := set(stated.rooms) - set(ROOMS):
        parser.error(f"there is no room {', '.join(sorted(unknown))}")
    began = time.monotonic()
    load_libraries()
    with tempfile.TemporaryDirectory(prefix="pretravel-mutation-") as folder:
        package = PROJECT / "src/pretravel"
        faults = named(package) if stated.named else []
        for room in stated.rooms or (ROOMS if stated.number else ()):
            faults += drawn(package, room, stated.number, stated.seed)
        faults = [f for f in faults if stated.only in str(f)]
        if stated.list:
            print(*faults, sep="\n")
            return 0
        make_line_map(Path(folder), stated.kept, stated.processes)
        return _campaign(faults, Path(folder), stated, began)


def _campaign(
    faults: Sequence[Fault], folder: Path, stated: argparse.Namespace, began: float
) -> int:
    line_map = LineMap(PROJECT, stated.kept)
    if failing := failing_without_fault(Scratch(folder / "without"), line_map):
        print(f"{failing} fails without a fault: nothing can be said about faults")
        return 1
    killers_file = stated.kept / "killers.json"
    killers: dict[str, str] = {}
    if killers_file.is_file():
        killers = json.loads(killers_file.read_text(encoding="utf-8"))
    verdicts = []

    def one(scratch: Scratch, fault: Fault) -> Verdict:
        first = killers.get(json.dumps(fault.key), "")
        return try_fault(fault, scratch, line_map, stated.patience, first)

    tried = in_processes(stated.processes, faults, one, folder)
    for number, (fault, verdict) in enumerate(tried, 1):
        verdicts.append(verdict)
        if verdict.killer:
            killers[json.dumps(fault.key)] = verdict.killer
            killers_file.write_text(json.dumps(killers), encoding="utf-8")
        _tell(verdict, f"{number}/{len(faults)}")
        if stated.results:
            with stated.results.open("a", encoding="utf-8") as file:
                print(json.dumps(_flat(verdict)), file=file)
    print(f"seed {stated.seed}, {(time.monotonic() - began) / 60.0:.0f} minutes")
    print(table(verdicts))
    left = [v for v in verdicts if not v.killer]
    for verdict in left:
        print(f"survived {verdict.tests} of {verdict.executing} tests:", verdict.fault)
    return int(any(v.fault.tests for v in left))  # a named fault has its tests


def _tell(verdict: Verdict, number: str) -> None:
    said = f"noticed by {verdict.killer}" if verdict.killer else ""
    said = said or f"SURVIVED {verdict.tests} tests ({verdict.executing} execute it)"
    print(f"{number} {verdict.fault}\n    {said}, {verdict.seconds:.1f} s", flush=True)


def _flat(verdict: Verdict) -> dict[str, object]:
    module, function, before, after = verdict.fault.key
    return {
        "module": module, "line": verdict.fault.lines[0], "function": function, "before": before,
        "after": after, "kind": verdict.fault.kind, "killer": verdict.killer,
        "tests": verdict.tests, "executing": verdict.executing,
        "seconds": round(verdict.seconds, 2),
    }  # fmt: skip


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    raise SystemExit(main())
