"""Who may use the server: addresses, other pages, the token."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from pretravel.app.access import LARGEST_REQUEST, Access, Guard

LOCAL = Access("127.0.0.1", "of-the-user")
SHARED = Access("0.0.0.0", "the-token")
PAGE = b'<html><script>1</script><script type="module"></script></html>'


def asked(
    access: Access, path: str = "/", *, kind: str = "http", method: str = "GET", **headers: str
) -> tuple[int, dict[str, str], bytes]:
    """Status (101: connected), headers and body of a request."""
    target, _, query = path.partition("?")
    given = {"host": "127.0.0.1:8765"} | {n.replace("_", "-"): v for n, v in headers.items()}
    if access is LOCAL:
        given["cookie"] = f"pretravel_8765={LOCAL.cookie}"
    scope = {
        "type": kind,
        "method": method,
        "path": target,
        "query_string": query.encode(),
        "headers": [(name.encode(), value.encode()) for name, value in given.items()],
    }
    sent: list[Any] = []

    async def page(scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
            return
        await receive()
        start = {"type": "http.response.start", "status": 200}
        await send({**start, "headers": [(b"content-type", b"text/html; charset=utf-8")]})
        await send({"type": "http.response.body", "body": PAGE[:30], "more_body": True})
        await send({"type": "http.response.body", "body": PAGE[30:]})

    async def receive() -> Any:
        return {"type": "http.request", "body": b""}

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(Guard(page, access)(scope, receive, send))
    first = sent[0]
    if first["type"].startswith("websocket"):
        return (101 if first["type"] == "websocket.accept" else 403), {}, b""
    found = {name.decode(): value.decode() for name, value in first["headers"]}
    return first["status"], found, b"".join(part.get("body", b"") for part in sent[1:])


def status(access: Access, path: str = "/", **more: str) -> int:
    return asked(access, path, **more)[0]


def test_a_damaged_port_is_refused_before_the_token_is_asked_for() -> None:
    for host in ("192.168.1.5:port", "192.168.1.5:99999999"):
        assert status(SHARED, host=host) == 421


def test_each_server_has_a_random_token() -> None:
    """On loopback too: other users of the computer reach it."""
    hosts = ("127.0.0.1", "localhost", "0.0.0.0", "192.168.1.5", "::", "shop.example")
    tokens = {Access.of(host).token for host in hosts}
    assert len(tokens) == len(hosts)
    assert min(map(len, tokens)) >= 32


@pytest.mark.parametrize(
    "host",
    [
        "evil.example", "127.0.0.1.evil.example:8765", "", "[", "10.0.0.1",
        "127.0.0.1:port", "127.0.0.1:99999999",
    ],
)  # fmt: skip
def test_names_that_a_stranger_points_here_are_refused(host: str) -> None:
    """DNS rebinding; 10.0.0.1 is no address of a server that listens on loopback."""
    for kind in ("http", "websocket"):
        assert status(LOCAL, kind=kind, host=host) in (421, 403)


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "http://127.0.0.1:1",
        "http://127.0.0.1:8765.evil.com",
        "http://[",
    ],
)
def test_requests_of_other_pages_are_refused(kind: str, origin: str) -> None:
    assert status(LOCAL, "/_nicegui_ws/socket.io/", kind=kind, origin=origin) == 403
    assert status(LOCAL, kind=kind, origin="http://127.0.0.1:8765") in (200, 101)


def test_what_another_page_embeds_is_refused_and_a_link_to_us_opened() -> None:
    assert status(LOCAL, sec_fetch_site="cross-site", sec_fetch_mode="no-cors") == 403
    frame = {"sec_fetch_site": "cross-site", "sec_fetch_mode": "navigate"}
    assert status(LOCAL, **frame, sec_fetch_dest="iframe") == 403
    assert status(LOCAL, **frame, sec_fetch_dest="document") == 200
    assert status(LOCAL, sec_fetch_site="same-origin", sec_fetch_mode="cors") == 200


def test_the_token_is_asked_for_once_and_then_kept_in_a_cookie() -> None:
    assert status(SHARED) == 403
    assert status(SHARED, kind="websocket") == 403
    assert status(SHARED, "/?token=wrong") == 403
    assert status(SHARED, method="POST", path="/upload/a/b?token=the-token", x_pretravel="1") == 403
    code, headers, _ = asked(SHARED, "/part?token=the-token&a=1")
    assert (code, headers["location"]) == (303, "/part?a=1")
    kept = headers["set-cookie"]
    assert kept.startswith(f"pretravel_8765={SHARED.cookie};")
    assert "the-token" not in kept
    assert "Secure" not in kept  # plain http: a browser would not send it back
    assert "HttpOnly" in kept
    assert "SameSite=Lax" in kept
    cookie = f"other=1; pretravel_8765={SHARED.cookie}"
    assert status(SHARED, cookie=cookie) == 200
    assert status(SHARED, kind="websocket", cookie=cookie) == 101
    assert status(SHARED, cookie="pretravel_8765=the-token") == 403
    assert status(SHARED, cookie=f"pretravel_1={SHARED.cookie}") == 403
    _, headers, _ = asked(SHARED, "/?token=the-token", x_forwarded_proto="https")
    assert "; Secure" in headers["set-cookie"]


def test_the_redirection_of_the_token_stays_on_this_server() -> None:
    _, headers, _ = asked(SHARED, "//evil.example/?token=the-token")
    assert headers["location"] == "/evil.example/"


def test_pages_have_headers_and_only_their_own_scripts_run() -> None:
    _, first, body = asked(LOCAL)
    _, second, _ = asked(LOCAL)
    policy = first["content-security-policy"]
    mark = policy.partition("'nonce-")[2].partition("'")[0]
    assert len(mark) >= 20
    assert f"'nonce-{mark}'" not in second["content-security-policy"]
    assert body.count(f'<script nonce="{mark}"'.encode()) == 2
    assert int(first["content-length"]) == len(body)
    scripts = next(rule for rule in policy.split("; ") if rule.startswith("script-src"))
    assert "unsafe-inline" not in scripts
    assert "frame-ancestors 'none'" in policy
    assert "http:" not in policy
    assert first["x-content-type-options"] == "nosniff"
    assert first["referrer-policy"] == "no-referrer"


def test_large_requests_are_refused() -> None:
    assert status(LOCAL, method="POST", content_length=str(LARGEST_REQUEST + 1)) == 413
    assert status(LOCAL, method="POST", content_length="many") == 413
    assert status(LOCAL, method="POST", content_length="10") == 200
    large = str(LARGEST_REQUEST + 1)
    assert status(LOCAL, "/upload/a/b", method="POST", content_length=large) == 403
    assert status(LOCAL, "/upload/a/b", method="POST", content_length=large, x_pretravel="1") == 200
