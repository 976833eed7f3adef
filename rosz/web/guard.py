"""Access to the page: by origin, and from other machines by password.

A browser sends the origin of the page that makes a request (``Origin``), and the host that it
believes to talk to (``Host``). A page from elsewhere may neither send requests nor open the
websocket. A foreign host name that leads to this machine is refused as well, because a page from
there would have the same origin. NiceGUI does not see what is refused.
"""

from __future__ import annotations

import hmac
import html
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, TypeAlias
from urllib.parse import parse_qs, parse_qsl, urlencode, urlsplit

from rosz.bridges.admission import is_loopback

__all__ = ("Guard", "Receive", "Scope", "Send")

Scope: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]
_App: TypeAlias = Callable[[Scope, Receive, Send], Awaitable[None]]

_COOKIE = "rosz-page"
_LOGIN = "/login"
_MOST_BYTES = 4096
_REFUSED, _UNKNOWN, _SEE_OTHER, _FULL = 403, 401, 303, 503
_TOO_MANY = "{} pages are open, which is the limit; close some, and load this one again."
_POLICY = 1008
_PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>rosz</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>
:root {{ color-scheme: light dark }}
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 22rem; margin: 18vh auto;
  padding: 0 1rem }}
input, button {{ font: inherit; width: 100%; box-sizing: border-box; padding: .6rem .8rem;
  margin-top: .8rem; border-radius: .4rem; border: 1px solid #8888 }}
button {{ background: #2456c8; color: white; border: 0; cursor: pointer }}
[role=alert] {{ color: #d33 }}</style><h1>rosz</h1>{body}</html>"""
_FORM = """{fault}<form method="post" action="{action}"><label>Password
<input type="password" name="password" autocomplete="current-password" autofocus required></label>
<button>Open</button></form>"""


class Guard:
    """The condition under which a request reaches the page.

    Args:
        password: The password; empty if none is needed.
        local: Whether the page is served at loopback addresses only.
        secure: Whether it is served with TLS.
        most: Largest number of pages that are open at a time.
    """

    def __init__(
        self, password: str = "", *, local: bool = True, secure: bool = False, most: int = 200
    ) -> None:
        self._most = most
        self._password = password
        self._local = local
        self._cookie = secrets.token_urlsafe(24)
        self._secure = secure

    def protect(self, app: _App, pages: Callable[[str], int] = lambda _path: 0) -> _App:
        """Return an ASGI application that lets only welcome requests through to another one.

        Args:
            app: The other one.
            pages: Function that returns the number of open pages if a path is that of a page,
                else 0.
        """

        async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
            if scope["type"] not in {"http", "websocket"}:
                await app(scope, receive, send)
                return
            headers = {
                name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]
            }
            if fault := self._objection(headers):
                await _refuse(scope, send, _REFUSED, f"<p>{html.escape(fault)}</p>")
            elif not self._is_known(headers):
                await self._admit(scope, receive, send)
            elif scope["type"] == "http" and pages(scope["path"]) >= self._most:
                await _refuse(scope, send, _FULL, f"<p>{_TOO_MANY.format(self._most)}</p>")
            else:
                await app(scope, receive, send)

        return guarded

    def _objection(self, headers: dict[str, str]) -> str:
        """Return why a request is refused; empty if it is not."""
        host = headers.get("host", "")
        name = urlsplit(f"//{host}").hostname or ""
        if self._local and not is_loopback(name):
            return (
                f"'{host}' is not this machine alone: open the page as localhost, or start it with"
                " --listen to reach it from other machines"
            )
        origin = headers.get("origin", "")
        if origin and urlsplit(origin).netloc != host:
            return f"pages of '{origin}' may not use this page"
        return ""

    def _is_known(self, headers: dict[str, str]) -> bool:
        """Return whether a request has the cookie of those who knew the password."""
        if not self._password:
            return True
        try:
            given = SimpleCookie(headers.get("cookie", "")).get(_COOKIE)
        except CookieError:
            return False
        return given is not None and hmac.compare_digest(given.value, self._cookie)

    def _is_password(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self._password.encode())

    async def _admit(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Take the password in the address or in a form, or show the form."""
        query = scope.get("query_string", b"").decode("latin-1")
        tokens = parse_qs(query).get("token", [])
        fault = ""
        if scope["type"] == "http" and scope["path"] == _LOGIN and scope["method"] == "POST":
            tokens = parse_qs(await _body(receive)).get("password", [""])
        if scope["type"] == "http" and tokens:
            if self._is_password(tokens[0]):
                await self._welcome(scope, query, send)
                return
            fault = '<p role="alert">The password is wrong.</p>'
        rest = _without_token(query)
        path = scope["path"] if scope["path"] != _LOGIN else _first(query, "next") or "/"
        target = path if not rest or scope["path"] == _LOGIN else f"{path}?{rest}"
        action = html.escape(f"{_LOGIN}?{urlencode({'next': target})}")
        await _refuse(scope, send, _UNKNOWN, _FORM.format(fault=fault, action=action))

    async def _welcome(self, scope: Scope, query: str, send: Send) -> None:
        """Give the cookie, and lead to the page without the password in its address."""
        if scope["path"] == _LOGIN:
            target = _first(query, "next")
        else:
            rest = _without_token(query)
            target = f"{scope['path']}?{rest}" if rest else scope["path"]
        if not target.startswith("/") or target.startswith("//"):
            target = "/"  # never to another host
        cookie = f"{_COOKIE}={self._cookie}; Path=/; HttpOnly; SameSite=Strict"
        headers = [
            (b"location", target.encode("latin-1", "ignore")),
            (b"set-cookie", (cookie + "; Secure" * self._secure).encode()),
            (b"cache-control", b"no-store"),
        ]
        await send({"type": "http.response.start", "status": _SEE_OTHER, "headers": headers})
        await send({"type": "http.response.body", "body": b""})


def _first(query: str, name: str) -> str:
    return parse_qs(query).get(name, [""])[0]


def _without_token(query: str) -> str:
    return urlencode([(name, value) for name, value in parse_qsl(query) if name != "token"])


async def _body(receive: Receive) -> str:
    """Return the beginning of the body of a request."""
    data = b""
    while len(data) < _MOST_BYTES:
        part = await receive()
        data += part.get("body", b"")
        if not part.get("more_body"):
            break
    return data[:_MOST_BYTES].decode("utf-8", "replace")


async def _refuse(scope: Scope, send: Send, status: int, body: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": _POLICY})
        return
    headers = [
        (b"content-type", b"text/html; charset=utf-8"),
        (b"cache-control", b"no-store"),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": _PAGE.format(body=body).encode()})
