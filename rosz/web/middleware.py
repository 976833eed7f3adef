"""Access to the page: by origin, and from other machines by password.

A page from elsewhere may neither send requests nor open the websocket. NiceGUI does not see
requests that are refused.
"""

from __future__ import annotations

import html
import re
import secrets
from collections.abc import Callable
from urllib.parse import parse_qs, urlencode

from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from rosz.access import PasswordGuesses, is_password, page_objection

_COOKIE = "rosz-page"
_LOGIN = "/login"
_MOST_BYTES = 4096
_MALFORMED, _REFUSED, _UNKNOWN, _SEE_OTHER, _TOO_OFTEN, _FULL = 400, 403, 401, 303, 429, 503
_OWN_PATH = re.compile(r"/(?![/\\])[^\x00-\x1f\x7f]*")
"""A path of this server: browsers take ``//x`` and ``/\\x`` for another host, and skip tabs."""
_TOO_MANY = "{} pages are open, which is the limit; close some, and load this one again."
_POLICY = 1008
_LEFT = (("No response returned.",), ("REQUEST_METHOD",))
"""Arguments of the errors that Starlette and engineio raise if a browser leaves too early."""
_FRESH = {"cache-control": "no-store"}
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


class AccessMiddleware:
    """An ASGI middleware that lets only those who may use the page reach it.

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
        self._guesses = PasswordGuesses()
        self._cookie = secrets.token_urlsafe(24)
        self._secure = secure

    def protect(self, app: ASGIApp, pages: Callable[[str], int] = lambda _path: 0) -> ASGIApp:
        """Return an ASGI application that passes requests that are not refused on to another one.

        Args:
            app: The other one.
            pages: Function that returns the number of open pages if a path is that of a page,
                else 0.
        """

        async def checked(scope: Scope, receive: Receive, send: Send) -> None:
            answer = app
            if scope["type"] in {"http", "websocket"}:
                try:
                    answer = await self._refuse(HTTPConnection(scope), receive, pages) or app
                except ValueError:
                    answer = _refusal(_MALFORMED, "<p>The request is malformed.</p>")
                if answer is not app and scope["type"] == "websocket":
                    answer = WebSocketClose(_POLICY)
            try:
                await answer(scope, receive, send)
            except (RuntimeError, KeyError, ValueError) as error:
                if scope["type"] == "websocket" and isinstance(error, ValueError):
                    # engineio raises it for a frame that it cannot parse, and closes nothing.
                    await WebSocketClose(_POLICY)(scope, receive, send)
                elif error.args[:1] not in _LEFT:  # uvicorn reports it
                    raise

        return checked

    async def _refuse(
        self, connection: HTTPConnection, receive: Receive, pages: Callable[[str], int]
    ) -> Response | None:
        """Return the answer to a request that is not passed on.

        Raises:
            ValueError: The request is malformed.
        """
        scope = connection.scope
        host, origin = (connection.headers.get(name, "") for name in ("host", "origin"))
        if fault := page_objection(host, origin, local=self._local):
            return _refusal(_REFUSED, f"<p>{html.escape(fault)}</p>")
        if self._password and not is_password(connection.cookies.get(_COOKIE, ""), self._cookie):
            return await self._log_in(connection, receive)
        if scope["type"] == "http" and pages(scope["path"]) >= self._most:
            return _refusal(_FULL, f"<p>{_TOO_MANY.format(self._most)}</p>")
        return None

    async def _log_in(self, connection: HTTPConnection, receive: Receive) -> Response:
        """Take the password in the address or in a form, or show the form.

        The right one gives the cookie, and leads to the page without the password in its address.
        """
        path, query = connection.scope["path"], connection.query_params
        given = query.get("token") or None
        rest = urlencode([(name, text) for name, text in query.multi_items() if name != "token"])
        target = f"{path}?{rest}" if rest else path
        if path == _LOGIN:
            target = query.get("next", "")
            if connection.scope.get("method") == "POST":
                given = parse_qs(await _body(receive)).get("password", [""])[0]
        if not _OWN_PATH.fullmatch(target):
            target = "/"  # never to another host
        right = given is not None and is_password(given, self._password)
        address = connection.client.host if connection.client else ""
        pause = 0.0 if given is None else self._guesses.pause(address, right)
        if right and not pause:
            cookie = f"{_COOKIE}={self._cookie}; Path=/; HttpOnly; SameSite=Strict"
            headers = {**_FRESH, "set-cookie": cookie + "; Secure" * self._secure}
            return RedirectResponse(target, _SEE_OTHER, headers)
        fault = "" if given is None else "The password is wrong."
        if pause:
            fault = f"The password was wrong too often. Try again in {pause:.0f} s."
        fault = f'<p role="alert">{fault}</p>' if fault else ""
        action = html.escape(f"{_LOGIN}?{urlencode({'next': target})}")
        status = _TOO_OFTEN if pause else _UNKNOWN
        return _refusal(status, _FORM.format(fault=fault, action=action))


async def _body(receive: Receive) -> str:
    """Return the beginning of the body of a request."""
    data = b""
    while len(data) < _MOST_BYTES:
        part = await receive()
        data += part.get("body", b"")
        if not part.get("more_body"):
            break
    return data[:_MOST_BYTES].decode("utf-8", "replace")


def _refusal(status: int, body: str) -> Response:
    return HTMLResponse(_PAGE.format(body=body), status, _FRESH)
