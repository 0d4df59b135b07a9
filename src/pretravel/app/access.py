"""Who may use the server: hosts, origins, the token, headers of answers, sizes of requests."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass
from typing import Any, TypeAlias
from urllib.parse import parse_qsl, urlencode, urlsplit

Message: TypeAlias = MutableMapping[str, Any]
Scope: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[Message]]
Send: TypeAlias = Callable[[Message], Awaitable[None]]
AsgiApp: TypeAlias = Callable[[Scope, Receive, Send], Awaitable[None]]

LARGEST_REQUEST = 1_000_000
"""Most bytes of the body of a request that is not an upload; uploads have limits of their own."""
UPLOAD_PATHS = ("/upload/", "/project/open")
_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-frame-options", b"DENY"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"permissions-policy", b"camera=(), microphone=(), geolocation=(), payment=(), usb=()"),
)


def is_loopback(host: str) -> bool:
    """Whether an address is reached from this computer only.

    >>> is_loopback("127.0.0.1"), is_loopback("localhost"), is_loopback("0.0.0.0")
    (True, True, False)
    """
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Access:
    """Who may use a server.

    Attributes
    ----------
    host : str
        Address that it listens on.
    token : str
        Needed once in the address, then in a cookie.
    """

    host: str
    token: str

    @staticmethod
    def of(host: str) -> Access:
        """With a random token, on this computer too: other users reach its ports."""
        return Access(host, secrets.token_urlsafe(24))

    def allows_host(self, header: str) -> bool:
        """Whether the header Host is an address of this server.

        A page of a stranger whose name is made to point here (DNS rebinding) has another one.

        >>> local = Access("127.0.0.1", "secret")
        >>> local.allows_host("localhost:8765"), local.allows_host("evil.example:8765")
        (True, False)
        >>> Access("0.0.0.0", "secret").allows_host("192.168.1.5:8765")
        True
        """
        name = host_name(header)
        if is_loopback(self.host):
            return is_loopback(name)
        own = socket.gethostname().lower()
        known = {"localhost", self.host.lower(), own, f"{own}.local", socket.getfqdn().lower()}
        return name in known or _is_address(name)

    def allows_token(self, given: str) -> bool:
        """Whether the token is right, in constant time."""
        return hmac.compare_digest(given.encode(), self.token.encode())

    @property
    def cookie(self) -> str:
        """What a browser keeps: made from the token, which it does not tell."""
        return hmac.new(self.token.encode(), b"cookie", hashlib.sha256).hexdigest()

    def allows_cookie(self, given: str) -> bool:
        """Whether it is that of the token, in constant time."""
        return hmac.compare_digest(given.encode(), self.cookie.encode())


def host_name(header: str) -> str:
    """The name in a header Host; empty where it is not an address with a port."""
    try:
        address = urlsplit(f"//{header}")
        return (address.hostname or "").lower() if (address.port or 80) > 0 else ""
    except ValueError:
        return ""


def _is_encrypted(scope: Scope, headers: MutableMapping[str, str]) -> bool:
    """Whether the browser speaks https: here, or to a proxy before this server."""
    return "https" in (scope.get("scheme"), headers.get("x-forwarded-proto"))


def _is_of(origin: str, host: str) -> bool:
    """Whether the header Origin is that of a page of this host."""
    try:
        return urlsplit(origin).netloc.lower() == host.lower()
    except ValueError:
        return False


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class Guard:
    """Middleware (ASGI) that refuses requests of others and completes the answers.

    Parameters
    ----------
    app : ASGI application
    access : Access
    """

    def __init__(self, app: AsgiApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, a connection, or the start and end of the server."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        # A prefix of a proxy is written into pages: none is trusted.
        scope["headers"] = [h for h in scope["headers"] if h[0] != b"x-forwarded-prefix"]
        headers = {
            name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]
        }
        refusal = self._refusal(scope, headers)
        if refusal is None:
            refusal = self._without_token(scope, headers)
        if refusal is not None:
            await _refuse(scope, receive, send, *refusal)
        elif scope["type"] == "http":
            await self._serve_page(scope, _limited(scope, headers, receive), send, headers["host"])
        else:
            await self._app(scope, receive, send)

    def _refusal(self, scope: Scope, headers: MutableMapping[str, str]) -> _Answer | None:
        """Status and text for a request that another page makes, or None."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self._access.allows_host(host):
            return (
                421,
                f"{host[:100]!r} is not an address of this workbench: open it by its address",
                {},
            )
        if origin is not None and not _is_of(origin, host):
            return 403, "requests of other pages are refused", {}
        foreign = headers.get("sec-fetch-site", "none") in ("cross-site", "same-site")
        opened = headers.get("sec-fetch-mode") == "navigate" and scope.get("method") == "GET"
        if foreign and not (opened and headers.get("sec-fetch-dest") == "document"):
            return 403, "requests of other pages are refused", {}
        uploads = str(scope["path"]).startswith(UPLOAD_PATHS)
        if uploads and scope.get("method") == "POST" and "x-pretravel" not in headers:
            return 403, "uploads need the header X-Pretravel", {}
        size = headers.get("content-length", "0")
        if not uploads and not (size.isdecimal() and int(size) <= LARGEST_REQUEST):
            return 413, f"the request has more than {LARGEST_REQUEST // 10**6} MB", {}
        return None

    def _without_token(self, scope: Scope, headers: MutableMapping[str, str]) -> _Answer | None:
        """Ask for the token; one in the address becomes a cookie."""
        port = urlsplit(f"//{headers['host']}").port or 80
        cookie = f"pretravel_{port}"  # cookies are shared by all ports of a host
        if self._access.allows_cookie(_cookies(headers.get("cookie", "")).get(cookie, "")):
            return None
        query = parse_qsl(scope.get("query_string", b"").decode("latin-1"))
        given = dict(query).get("token", "")
        if scope["type"] == "http" and scope["method"] == "GET" and given:
            if self._access.allows_token(given):
                rest = urlencode([(name, value) for name, value in query if name != "token"])
                place = "/" + str(scope["path"]).lstrip("/\\") + (f"?{rest}" if rest else "")
                kept = f"{cookie}={self._access.cookie}; Path=/; HttpOnly; SameSite=Lax"
                kept += "; Max-Age=2592000" + ("; Secure" if _is_encrypted(scope, headers) else "")
                return 303, "", {"location": place, "set-cookie": kept}
            return 403, "this token is not that of the workbench", {}
        return 403, "open the address with its token, as the terminal shows it", {}

    async def _serve_page(self, scope: Scope, receive: Receive, send: Send, host: str) -> None:
        """Serve with headers; scripts of a page get the mark without which none runs."""
        mark = secrets.token_urlsafe(16)
        page: list[Message] = []

        async def complete(message: Message) -> None:
            if message["type"] == "http.response.start":
                added = [*_HEADERS, (b"content-security-policy", _policy(host, mark))]
                names = {name for name, _ in added}
                kept = [h for h in message["headers"] if h[0].lower() not in names]
                message["headers"] = [*kept, *added]
                if dict(kept).get(b"content-type", b"").startswith(b"text/html"):
                    page.append(message)
                    return
            elif page:
                page.append(message)
                if not message.get("more_body"):
                    for part in _marked(page, mark):
                        await send(part)
                    page.clear()
                return
            await send(message)

        await self._app(scope, receive, complete)


_Answer: TypeAlias = tuple[int, str, dict[str, str]]


def _marked(page: list[Message], mark: str) -> list[Message]:
    """A page whose scripts have the mark; texts in it are escaped, and contain no tag."""
    start, *parts = page
    body = b"".join(part.get("body", b"") for part in parts)
    body = body.replace(b"<script", f'<script nonce="{mark}"'.encode())
    headers = [h for h in start["headers"] if h[0].lower() != b"content-length"]
    start["headers"] = [*headers, (b"content-length", str(len(body)).encode())]
    return [start, {"type": "http.response.body", "body": body}]


def _policy(host: str, mark: str) -> bytes:
    """What a page may load: from this server only. NiceGUI and Vue need eval and inline styles."""
    rules = (
        "default-src 'self'",
        f"script-src 'self' 'nonce-{mark}' 'unsafe-eval'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        f"connect-src 'self' ws://{host} wss://{host} data: blob:",
        "worker-src 'self' blob:",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
    return "; ".join(rules).encode("latin-1", "replace")


def _cookies(header: str) -> dict[str, str]:
    pairs = (part.strip().partition("=") for part in header.split(";"))
    return {name: value for name, _, value in pairs}


def _limited(scope: Scope, headers: MutableMapping[str, str], receive: Receive) -> Receive:
    """Cut a body without a stated length where it is longer than a request may be."""
    if str(scope["path"]).startswith(UPLOAD_PATHS) or "content-length" in headers:
        return receive
    left = [LARGEST_REQUEST]

    async def counted() -> Message:
        message = await receive()
        left[0] -= len(message.get("body", b""))
        return {"type": "http.disconnect"} if left[0] < 0 else message

    return counted


async def _refuse(
    scope: Scope, receive: Receive, send: Send, status: int, text: str, extra: dict[str, str]
) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": text[:100]})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    headers += [(name.encode(), value.encode("latin-1")) for name, value in extra.items()]
    start = {"type": "http.response.start", "status": status, "headers": [*headers, *_HEADERS]}
    await send(start)
    await send({"type": "http.response.body", "body": text.encode()})
