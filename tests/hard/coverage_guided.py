"""Files that atheris makes with the coverage of a reader: needs ``pip install --group hard``.

``python -m tests.hard.coverage_guided grbl -max_total_time=600`` goes on until a fault. It keeps
the files that reached new code in the folder ``hard-corpus``, and a file with a fault beside them.
Options after the name are those of libFuzzer.
"""

from __future__ import annotations

import sys
from pathlib import Path

FOLDER = Path("hard-corpus")


def main() -> None:
    """Try one reader. The readers are imported here: atheris changes them while it imports them."""
    import atheris

    with atheris.instrument_imports(include=["pretravel"]):
        from tests.hard.run import READERS
        from tests.support.mutated_files import LONGEST, NUMBERS, TEXTS, fault_of

    reader = READERS[sys.argv[1]]
    folder = FOLDER / reader.name
    folder.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(reader.corpus()):
        (folder / f"sample-{number}").write_bytes(content)
    words = folder.with_suffix(".words")
    quoted = (
        "".join(f"\\x{byte:02x}" for byte in word)
        for word in (*reader.words, *NUMBERS, *TEXTS)
        if 0 < len(word) < 60
    )
    words.write_text("".join(f'"{word}"\n' for word in quoted), encoding="ascii")

    def try_one(content: bytes) -> None:
        fault = fault_of(reader, content, longest=None)
        if fault is not None:
            raise RuntimeError(fault)

    options = [f"-timeout={LONGEST:.0f}", "-rss_limit_mb=2048", f"-dict={words}",
               f"-artifact_prefix={folder}-", "-max_len=20000"]  # fmt: skip
    atheris.Setup([sys.argv[0], *options, *sys.argv[2:], str(folder)], try_one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
