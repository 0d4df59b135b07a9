"""Start and end of ``pretravel app``, and what strangers get; without a browser."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import urlsplit

import pytest

import pretravel
from pretravel.app.project import Project, StoredFile
from pretravel.app.project_file import project_bytes, read_project, write_project
from tests.browser.workbench_server import PATIENCE, RunningWorkbench, cookie, running_workbench
from tests.support.commands import run

OURS = {"X-Pretravel": "upload"}


def answer(
    address: str, headers: dict[str, str] | None = None, data: bytes | None = None
) -> tuple[int, str]:
    request = urllib.request.Request(address, data=data, headers=cookie(address) | (headers or {}))
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as found:
            return found.status, found.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()


def started_again(workbench: RunningWorkbench) -> str:
    """End it with Ctrl-C; what it has said."""
    assert workbench.interrupt() == 0
    assert workbench.process.stdout is not None
    return workbench.process.stdout.read()


def test_it_ends_cleanly_and_shows_the_project_again(tmp_path: Path) -> None:
    sent = Project("From a colleague", "0123456789abcdef")
    sent.screen("engineer").settings["diameter"] = 25.0
    sent.screen("engineer").files["touches"] = (StoredFile("a.csv", b"x_mm"),)
    with running_workbench(tmp_path) as workbench:
        port = urlsplit(workbench.address).port
        assert answer(f"{workbench.address}project/open?name=a.zip", OURS, b"PK no")[0] == 422
        to = f"{workbench.address}project/open?name=p.pretravel"
        assert answer(to, OURS, project_bytes(sent))[0] == 200
        other = run("app", "--no-browser", "--port", str(port), code=2)
        assert f"port {port}: Address already in use. Is another workbench running" in other
        said = started_again(workbench)
        assert "Traceback" not in said
        assert "Could not" not in said
    with running_workbench(tmp_path) as workbench:
        assert "From a colleague" in answer(workbench.address)[1]
        (path,) = (tmp_path / "pretravel" / "projects").glob("0123*.pretravel")
        found = read_project(path).screen("engineer")
        assert found.settings["diameter"] == 25.0
        assert found.files["touches"][0].content == b"x_mm"
        # The same file in a second workbench would lose the changes of one of them.
        second = run("app", str(path), "--no-browser", "--port", "0", code=2)
        assert f"is open in another workbench, at {workbench.address}" in second


def test_a_named_project_is_opened_and_made(tmp_path: Path) -> None:
    path = tmp_path / "Probe 7.pretravel"
    write_project(path, Project("Probe of machine 3"))
    with running_workbench(tmp_path, str(path)) as workbench:
        assert "Probe of machine 3" in answer(workbench.address)[1]
    (tmp_path / "no.pretravel").write_bytes(b"x_mm")
    refused = run("app", str(tmp_path / "no.pretravel"), "--no-browser", code=2)
    assert "this is not a project of pretravel" in refused
    missing = run("app", str(tmp_path / "none" / "a.pretravel"), "--no-browser", code=2)
    assert "does not exist" in missing


@pytest.mark.parametrize("host", ["0.0.0.0", "127.0.0.1"])
def test_other_computers_and_other_users_need_the_token(tmp_path: Path, host: str) -> None:
    with running_workbench(tmp_path, "--host", host) as workbench:
        base, none = workbench.address, {"Cookie": ""}
        code, text = answer(base, none)
        assert code == 403
        assert "with its token" in text
        assert answer(f"{base}static/{pretravel.__version__}/workbench.js", none)[0] == 403
        assert answer(f"{base}_nicegui_ws/socket.io/?EIO=4&transport=polling", none)[0] == 403
        assert answer(f"{base}project/download", none)[0] == 403
        assert answer(base)[0] == 200


def test_strangers_on_loopback_get_nothing(tmp_path: Path) -> None:
    with running_workbench(tmp_path) as workbench:
        socket_io = f"{workbench.address}_nicegui_ws/socket.io/?EIO=4&transport=polling"
        assert answer(workbench.address, {"Host": "evil.example"})[0] == 421
        assert answer(socket_io, {"Origin": "http://evil.example"})[0] == 403
        assert answer(socket_io)[0] == 200
        upload = f"{workbench.address}upload/none/engineer/touches?name=a.csv"
        assert answer(upload, {}, b"1")[0] == 403
        code, text = answer(upload, OURS, b"1")  # no page has opened this place
        assert code == 422
        assert "load this page again" in json.loads(text)["error"]


def test_a_port_is_chosen_when_the_usual_one_is_in_use(monkeypatch: pytest.MonkeyPatch) -> None:
    from pretravel.app import starting as start

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        usual = taken.getsockname()[1]
        monkeypatch.setattr(start, "USUAL_PORT", usual)
        assert start.free_port("127.0.0.1", None) != usual


def test_importing_pretravel_imports_nothing_of_the_workbench() -> None:
    """Nor do the other commands."""
    program = (
        "import sys, pretravel.cli.main; "
        "print([m for m in sys.modules if m.partition('.')[0] in "
        "('nicegui', 'fastapi', 'starlette', 'uvicorn', 'plotly', 'platformdirs')"
        " or m.startswith('pretravel.app')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_what_strangers_ask_for_is_written_out_in_the_terminal(tmp_path: Path) -> None:
    """A line break and an escape in an address could write lines of their own, or colour them."""
    with running_workbench(tmp_path) as workbench:
        assert answer(f"{workbench.address}x%0aWARNING%20all%20is%20lost%1b%5b31m")[0] == 404
        said = started_again(workbench)
    assert "\x1b" not in said
    assert "\nWARNING all is lost" not in said


def test_an_upload_that_breaks_off_prints_no_traceback(tmp_path: Path) -> None:
    with running_workbench(tmp_path) as workbench:
        host, _, port = workbench.address.removeprefix("http://").strip("/").partition(":")
        shown = answer(f"{workbench.address}engineer")[1]  # opens the slot
        place = re.search(r"/upload/\w+/engineer/touches", shown)
        assert place is not None
        known = cookie(workbench.address)["Cookie"]
        head = (
            f"POST {place[0]}?name=a.csv HTTP/1.1\r\nHost: {host}:{port}\r\n"
            f"Cookie: {known}\r\nX-Pretravel: upload\r\nContent-Length: 1000\r\n\r\nx_mm"
        )
        with socket.create_connection((host, int(port)), timeout=PATIENCE) as connection:
            connection.sendall(head.encode())
        assert answer(workbench.address)[0] == 200  # it goes on
        said = started_again(workbench)
    assert "Traceback" not in said


PAGES = ("", "engineer", "task/repeat", "project", "help", "project/download", "nothing")


def test_an_unknown_project_is_none_and_never_another_one(tmp_path: Path) -> None:
    """Its page and its download would be those of the project that was opened last."""
    sent = Project("Secret of another job", "0123456789abcdef")
    with running_workbench(tmp_path) as workbench:
        to = f"{workbench.address}project/open?name=p.pretravel"
        assert answer(to, OURS, project_bytes(sent))[0] == 200
        for page in PAGES:
            code, text = answer(f"{workbench.address}{page}?project=fedcba9876543210")
            assert code == 404, page
            assert "There is no project at this address" in text
            assert "Secret" not in text
        assert answer(f"{workbench.address}engineer?project={sent.identity}")[0] == 200


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_every_end_saves_and_leaves_nothing_else(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was dropped just before, which the pause of saving has not saved yet."""
    for variable, folder in (("TMPDIR", "tmp"), ("PRETRAVEL_CACHE", "cache")):
        (tmp_path / folder).mkdir(mode=0o700)
        monkeypatch.setenv(variable, str(tmp_path / folder))
    sent = Project("Last", "0123456789abcdef")
    with running_workbench(tmp_path) as workbench:
        to = f"{workbench.address}project/open?name=p.pretravel"
        assert answer(to, OURS, project_bytes(sent))[0] == 200
        workbench.process.send_signal(getattr(signal, name))
        assert workbench.process.wait(timeout=PATIENCE) == 0
        assert workbench.process.stdout is not None
        assert "Traceback" not in workbench.process.stdout.read()
    assert (tmp_path / "pretravel" / "projects" / "0123456789abcdef.pretravel").exists()
    assert list((tmp_path / "tmp").iterdir()) == []
    assert list((tmp_path / "cache").glob("*.lock")) == []


def test_a_project_that_cannot_be_saved_is_kept_elsewhere_and_the_end_is_a_fault(
    tmp_path: Path,
) -> None:
    stick = tmp_path / "stick"
    stick.mkdir()
    with running_workbench(tmp_path, str(stick / "a.pretravel")) as workbench:
        code, page = answer(f"{workbench.address}task/repeat")
        assert code == 200
        identity = re.findall(r"project=([0-9a-f]{16})", page)[0]
        stick.rmdir()
        to = f"{workbench.address}upload/{identity}/task-repeat/log?name=log.csv"
        assert answer(to, OURS, b"x_mm,y_mm,z_mm")[0] == 200
        assert workbench.interrupt() == 2
        assert workbench.process.stdout is not None
        said = workbench.process.stdout.read()
    assert "does not exist" in said
    (kept,) = (tmp_path / "pretravel" / "projects").glob("unsaved-*.pretravel")
    assert f"is kept in {kept}" in said.replace("\n", "").replace("  ", " ") or kept.name in said
    (file,) = read_project(kept).screen("task-repeat").files["log"]
    assert file.content == b"x_mm,y_mm,z_mm"
