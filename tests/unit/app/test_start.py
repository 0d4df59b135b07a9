"""The start of the workbench: what its browser is given, which other users can read."""

from __future__ import annotations

import os
import re
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import HTTPCookieProcessor, build_opener, url2pathname

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a browser that is a shell script")
_SECONDS = 120.0


@contextmanager
def _started(folder: Path, host: str) -> Iterator[tuple[str, str]]:
    """The address that the terminal shows and what the browser is given, while the server runs."""
    browser, given, shown = folder / "browser", folder / "given", folder / "shown"
    browser.write_text(f'#!/bin/sh\n(echo "$*"; env) > {given}.new && mv {given}.new {given}\n')
    browser.chmod(0o700)
    environment = os.environ | {
        "BROWSER": f"{browser} %s",
        "PYTHONUNBUFFERED": "1",
        "XDG_DATA_HOME": str(folder),
    }
    environment.pop("PYTEST_CURRENT_TEST")  # NiceGUI would take the server for a test of its own
    command = [sys.executable, "-m", "pretravel", "app", str(folder / "p.pretravel")]
    with shown.open("w") as terminal:
        server = subprocess.Popen(
            [*command, "--host", host, "--port", "0"], env=environment, stdout=terminal
        )
    try:
        end = time.monotonic() + _SECONDS
        while not (given.exists() and "(Ctrl-C" in shown.read_text()):
            assert server.poll() is None, shown.read_text()
            assert time.monotonic() < end, shown.read_text()
            time.sleep(0.05)
        found = re.search(r"is at (\S+) ", shown.read_text())
        assert found is not None
        yield found[1], given.read_text()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(_SECONDS)


# The tests in a browser start it on this computer alone.
@pytest.mark.long
@pytest.mark.parametrize("host", ["0.0.0.0", pytest.param("127.0.0.1", marks=pytest.mark.slow)])
def test_no_process_is_given_the_token(tmp_path: Path, host: str) -> None:
    """Other users read command lines; a page of the user alone forwards the browser, and is gone
    at the end. No answer tells another page the address."""
    with _started(tmp_path, host) as (address, given):
        token = urlsplit(address).query.removeprefix("token=")
        assert len(token) >= 32
        assert token not in given
        page = Path(url2pathname(urlsplit(given.splitlines()[0]).path))
        assert urlsplit(given).scheme == "file"
        assert stat.S_IMODE(page.stat().st_mode) == 0o600
        assert stat.S_IMODE(page.parent.stat().st_mode) == 0o700
        assert '<meta name="referrer" content="no-referrer">' in page.read_text()
        forwarded = re.search(r'content="0; url=([^"]+)"', page.read_text())
        assert forwarded is not None
        assert forwarded[1] == address
        opened = build_opener(HTTPCookieProcessor()).open(forwarded[1])
        assert opened.status == 200
        assert "token" not in opened.url
        assert opened.headers["Referrer-Policy"] == "no-referrer"
        assert token.encode() not in opened.read()
        with pytest.raises(HTTPError, match="403"):
            build_opener().open(address.partition("?")[0])
    assert not page.parent.exists()
