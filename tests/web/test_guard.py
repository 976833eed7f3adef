"""Who may open the page: origin, host, password; without a browser."""

from __future__ import annotations

import asyncio
from collections.abc import MutableMapping
from typing import Any

import pytest

from rosz.web.guard import Guard, Receive, Scope, Send

HOME = {"host": "localhost:8080"}


async def _page(scope: Scope, _receive: Receive, send: Send) -> None:
    kind = "http.response" if scope["type"] == "http" else "websocket"
    await send(
        {
            "type": f"{kind}.start" if kind == "http.response" else "websocket.accept",
            "status": 200,
            "headers": [],
        }
    )
    await send({"type": f"{kind}.body", "body": b"the page"})


def request(
    guard: Guard,
    headers: dict[str, str],
    path: str = "/",
    *,
    body: str | None = None,
    kind: str = "http",
) -> tuple[int, dict[str, str], str]:
    """Send a request, and return status, headers and body; 101 for an open websocket."""
    sent: list[MutableMapping[str, Any]] = []

    async def receive() -> MutableMapping[str, Any]:  # ASGI's form
        return {"type": "http.request", "body": (body or "").encode(), "more_body": False}

    async def send(event: MutableMapping[str, Any]) -> None:  # likewise
        sent.append(event)

    scope = {
        "type": kind,
        "method": "GET" if body is None else "POST",
        "path": path.partition("?")[0],
        "query_string": path.partition("?")[2].encode(),
        "headers": [(name.encode(), value.encode()) for name, value in headers.items()],
    }

    async def run() -> None:
        await guard.protect(_page)(scope, receive, send)

    asyncio.run(run())
    if kind == "websocket":
        return (101 if sent[0]["type"] == "websocket.accept" else 403), {}, ""
    found = {name.decode(): value.decode() for name, value in sent[0]["headers"]}
    return sent[0]["status"], found, sent[1]["body"].decode()


@pytest.mark.parametrize("host", ["localhost:8080", "127.0.0.1:8080", "[::1]:8080"])
def test_this_machine_may_open_the_page(host: str) -> None:
    assert request(Guard(), {"host": host})[0] == 200
    same = {"host": host, "origin": f"http://{host}"}
    assert request(Guard(), same, kind="websocket")[0] == 101


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost:9999", "http://localhost"]
)
def test_other_origins_are_refused(origin: str, kind: str) -> None:
    status, _, body = request(Guard(), {**HOME, "origin": origin}, kind=kind)
    assert status == 403
    assert kind == "websocket" or f"pages of &#x27;{origin}&#x27; may not use this page" in body


def test_a_foreign_name_of_this_machine_is_refused() -> None:
    status, _, body = request(Guard(), {"host": "evil.example:8080"})
    assert status == 403
    assert "is not this machine alone" in body
    assert request(Guard("word", local=False), {"host": "robot:8080"})[0] == 401


def test_the_password_in_the_address_opens_the_page() -> None:
    guard = Guard("word", local=False)
    status, headers, _ = request(guard, HOME, "/topics?token=word&topic=%2Fa")
    assert (status, headers["location"]) == (303, "/topics?topic=%2Fa")
    assert "HttpOnly; SameSite=Strict" in headers["set-cookie"]
    known = {**HOME, "cookie": headers["set-cookie"].partition(";")[0]}
    assert request(guard, known)[0] == 200
    assert request(guard, known, kind="websocket")[0] == 101


def test_the_password_in_the_form_opens_the_page() -> None:
    guard = Guard("wörd & more", local=False)
    status, _, body = request(guard, HOME, "/graph?all=1")
    assert status == 401
    assert 'action="/login?next=%2Fgraph%3Fall%3D1"' in body
    answer = request(guard, HOME, "/login?next=%2Fgraph", body="password=w%C3%B6rd+%26+more")
    assert (answer[0], answer[1]["location"]) == (303, "/graph")


@pytest.mark.parametrize("path", ["/?token=nope", "/login?next=%2F"])
def test_a_wrong_password_is_refused_in_words(path: str) -> None:
    guard = Guard("word", local=False)
    body = "password=nope" if path.startswith("/login") else None
    status, headers, text = request(guard, HOME, path, body=body)
    assert status == 401
    assert "set-cookie" not in headers
    assert "The password is wrong." in text
    assert request(guard, {**HOME, "cookie": "rosz-page=x"})[0] == 401
    assert request(guard, {**HOME, "cookie": "rosz-page=x"}, kind="websocket")[0] == 403


@pytest.mark.parametrize("target", ["https://evil.example", "//evil.example", ""])
def test_the_form_never_leads_elsewhere(target: str) -> None:
    guard = Guard("word", local=False)
    answer = request(guard, HOME, f"/login?next={target}", body="password=word")
    assert answer[1]["location"] == "/"
