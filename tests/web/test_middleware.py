"""Who may open the page: origin, host, password; without a browser."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import MutableMapping
from contextlib import nullcontext
from typing import Any

import pytest
from starlette.types import Receive, Scope, Send

from rosz.access import PasswordGuesses
from rosz.web.middleware import AccessMiddleware

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
    middleware: AccessMiddleware,
    headers: dict[str, str],
    path: str = "/",
    *,
    body: str | None = None,
    kind: str = "http",
    client: str = "192.0.2.1",
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
        "headers": [(name.encode(), value.encode("latin-1")) for name, value in headers.items()],
        "client": (client, 1),
    }

    async def run() -> None:
        await middleware.protect(_page)(scope, receive, send)

    asyncio.run(run())
    if kind == "websocket":
        return (101 if sent[0]["type"] == "websocket.accept" else 403), {}, ""
    found = {name.decode(): value.decode() for name, value in sent[0]["headers"]}
    return sent[0]["status"], found, sent[1]["body"].decode()


@pytest.mark.parametrize("host", ["localhost:8080", "127.0.0.1:8080", "[::1]:8080"])
def test_this_machine_may_open_the_page(host: str) -> None:
    assert request(AccessMiddleware(), {"host": host})[0] == 200
    same = {"host": host, "origin": f"http://{host}"}
    assert request(AccessMiddleware(), same, kind="websocket")[0] == 101


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost:9999", "http://localhost"]
)
def test_other_origins_are_refused(origin: str, kind: str) -> None:
    status, _, body = request(AccessMiddleware(), {**HOME, "origin": origin}, kind=kind)
    assert status == 403
    assert kind == "websocket" or f"pages of &#x27;{origin}&#x27; may not use this page" in body


def test_a_foreign_name_of_this_machine_is_refused() -> None:
    status, _, body = request(AccessMiddleware(), {"host": "evil.example:8080"})
    assert status == 403
    assert "is not this machine alone" in body
    assert request(AccessMiddleware("word", local=False), {"host": "robot:8080"})[0] == 401


def test_the_password_in_the_address_opens_the_page() -> None:
    middleware = AccessMiddleware("word", local=False)
    status, headers, _ = request(middleware, HOME, "/topics?token=word&topic=%2Fa")
    assert (status, headers["location"]) == (303, "/topics?topic=%2Fa")
    assert "HttpOnly; SameSite=Strict" in headers["set-cookie"]
    known = {**HOME, "cookie": headers["set-cookie"].partition(";")[0]}
    assert request(middleware, known)[0] == 200
    assert request(middleware, known, kind="websocket")[0] == 101


def test_the_password_in_the_form_opens_the_page() -> None:
    middleware = AccessMiddleware("wörd & more", local=False)
    status, _, body = request(middleware, HOME, "/graph?all=1")
    assert status == 401
    assert 'action="/login?next=%2Fgraph%3Fall%3D1"' in body
    answer = request(middleware, HOME, "/login?next=%2Fgraph", body="password=w%C3%B6rd+%26+more")
    assert (answer[0], answer[1]["location"]) == (303, "/graph")


@pytest.mark.parametrize("path", ["/?token=nope", "/login?next=%2F"])
def test_a_wrong_password_is_refused_in_words(path: str) -> None:
    middleware = AccessMiddleware("word", local=False)
    body = "password=nope" if path.startswith("/login") else None
    status, headers, text = request(middleware, HOME, path, body=body)
    assert status == 401
    assert "set-cookie" not in headers
    assert "The password is wrong." in text
    assert request(middleware, {**HOME, "cookie": "rosz-page=x"})[0] == 401
    assert request(middleware, {**HOME, "cookie": "rosz-page=x"}, kind="websocket")[0] == 403


@pytest.mark.parametrize(
    "target",
    [
        "https://evil.example",
        "//evil.example",
        "/\\evil.example",
        "/%5Cevil.example",
        "/%09/evil.example",
        "/%0d%0a",
        "/%00",
        "\\\\evil.example",
        "%09//evil.example",
        "javascript:alert(1)",
        "",
    ],
)
def test_the_form_never_leads_elsewhere(target: str) -> None:
    middleware = AccessMiddleware("word", local=False)
    assert request(middleware, HOME, f"/login?next={target}")[0] == 401
    answer = request(middleware, HOME, f"/login?next={target}", body="password=word")
    assert answer[1]["location"] == "/"


@pytest.mark.parametrize("path", ["//evil.example", "/\\evil.example", "/\t/evil.example"])
def test_the_password_in_the_address_never_leads_elsewhere(path: str) -> None:
    middleware = AccessMiddleware("word", local=False)
    assert request(middleware, HOME, f"{path}?token=word")[1]["location"] == "/"


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "headers",
    [
        {"host": "["},
        {"host": "[::1"},
        {**HOME, "origin": "http://["},
        {**HOME, "origin": "http://[x]"},
    ],
)
def test_malformed_requests(headers: dict[str, str], kind: str) -> None:
    for middleware in (AccessMiddleware(), AccessMiddleware("word")):
        assert request(middleware, headers, kind=kind)[0] == (400 if kind == "http" else 403)


@pytest.mark.parametrize(
    "cookie",
    ["rosz-page=ÿþ", 'rosz-page="\\777"', "=;;=", "\0", 'rosz-page="\\"', "rosz-page=\x80"],
)
@pytest.mark.parametrize("path", ["/", "/?token=%ff%ed%a0%80", "/login?next=%ed%a0%80"])
def test_odd_cookies_are_not_the_right_one(cookie: str, path: str) -> None:
    middleware = AccessMiddleware("word", local=False)
    assert request(middleware, {**HOME, "cookie": cookie}, path)[0] in {400, 401}


def test_guessing_becomes_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PasswordGuesses.__init__, "__defaults__", (lambda: 100.0,))  # no pause ends
    middleware = AccessMiddleware("word", local=False)
    wrong = [request(middleware, HOME, "/?token=nope") for _ in range(20)]
    assert [status for status, *_ in wrong[:6]] == [401] * 5 + [429]
    assert {status for status, *_ in wrong[5:]} == {429}
    assert "The password was wrong too often. Try again in 1 s." in wrong[-1][2]
    assert request(middleware, HOME, "/login", body="password=word")[0] == 429
    assert request(middleware, HOME)[0] == 401
    assert request(middleware, HOME, "/?token=word", client="192.0.2.7")[0] == 303


def test_the_pauses_of_guesses() -> None:
    now = 0.0
    guesses = PasswordGuesses(lambda: now)
    pauses = []
    for _ in range(15):
        while pause := guesses.pause("a", False):
            pauses.append(pause)
            now += pause
    assert pauses == [1, 2, 4, 8, 16, 32, 60, 60, 60, 60]
    assert guesses.pause("b", False) == 0
    assert guesses.pause("a", True) == 60
    now += 60
    assert guesses.pause("a", True) == 0
    assert [guesses.pause("a", False) for _ in range(6)] == [0] * 5 + [1]
    now += 2000
    assert [guesses.pause("a", False) for _ in range(6)] == [0] * 5 + [1]
    for number in range(20_000):
        guesses.pause(str(number), False)
    assert len(guesses._wrong) == 10_000


@pytest.mark.parametrize(
    ("addresses", "other"),
    [
        ("2001:db8::1 2001:db8:0:0:ffff::9 2001:db8::a%eth0", "2001:db8:0:1::1"),
        ("192.0.2.7 ::ffff:192.0.2.7", "192.0.2.8"),
    ],
)
def test_guesses_of_a_network_count_together(addresses: str, other: str) -> None:
    guesses = PasswordGuesses(lambda: 100.0)
    for address in itertools.islice(itertools.cycle(addresses.split()), 5):
        assert guesses.pause(address, False) == 0
    assert all(guesses.pause(address, True) for address in addresses.split())
    assert guesses.pause(other, True) == 0


@pytest.mark.parametrize(
    ("text", "raises"), [("No response returned.", False), ("another fault", True)]
)
def test_a_browser_that_left_is_no_fault(text: str, *, raises: bool) -> None:
    async def fail(_scope: Scope, _receive: Receive, _send: Send) -> None:
        raise RuntimeError(text)

    async def run() -> None:
        headers = [(b"host", HOME["host"].encode())]
        scope = {"type": "http", "path": "/", "query_string": b"", "headers": headers}
        await AccessMiddleware().protect(fail)(scope, _nothing, _nothing)

    async def _nothing(*_: object) -> Any:  # nothing is received or sent
        pytest.fail("no answer is due")

    with pytest.raises(RuntimeError, match=text) if raises else nullcontext():
        asyncio.run(run())
