"""Calls of a server of ROS 2, which keeps the newest requests that wait and drops others."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from queue import Empty
from typing import Any

import pytest
from interop.plain import Plain, plain_session
from network import TIMEOUT, Network, eventually

from rosz.errors import ClosedError, ServiceError, WaitTimeout
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.node import Client
from rosz.qos import SERVICES
from rosz.wire import Kind, Token, entity_key, format_token

DEPTH = SERVICES.depth
CALLS = 5 * DEPTH


class DroppingServer:
    """A server of another program, which handles what it keeps when it is told to."""

    def __init__(self, plain: Plain, domain: int) -> None:
        zid = str(plain.session.zid())
        name, text = AddTwoInts._type_name, AddTwoInts._type_hash
        self.key = entity_key(domain, "/add", name, text)
        self._queries = plain.queries(self.key)
        token = Token(
            *(domain, zid, 0, 1, Kind.SERVICE, "/", "adder"),
            name="/add",
            type_name=name,
            type_hash=text,
            qos=SERVICES,
        )
        plain.token(format_token(token))

    def take(self, count: int) -> list[Any]:
        """Wait for some queries."""
        return [self._queries.get(timeout=TIMEOUT) for _ in range(count)]

    def is_idle(self) -> bool:
        """Tell whether no query waits."""
        return self._queries.empty()

    def drop(self) -> bool:
        """Drop a query that waits, and tell whether there was one."""
        with suppress(Empty):
            query: Any = self._queries.get_nowait()
            query.drop()
            return True
        return False

    def reply(self, query: Any) -> None:
        """Reply to a query."""
        with query:
            request = AddTwoInts.Request._decode(query.payload.to_bytes())
            response = AddTwoInts.Response(request.a + request.b)
            query.reply(self.key, AddTwoInts.Response._encode(response))


@pytest.fixture
def server(network: Network) -> Iterator[DroppingServer]:
    network.session()  # who holds the meeting point
    with plain_session(network.rendezvous) as plain:
        yield DroppingServer(plain, network.domain)


@pytest.fixture
def client(network: Network, server: DroppingServer) -> Client:
    made = network.node("caller").client("add", AddTwoInts, timeout=TIMEOUT)
    made.wait_for_service()
    assert server.is_idle()
    return made


def test_no_more_calls_are_on_their_way_than_the_server_keeps(
    client: Client, server: DroppingServer
) -> None:
    with ThreadPoolExecutor(CALLS) as pool:
        calls = [pool.submit(client, number, 1) for number in range(CALLS)]
        for _ in range(CALLS // DEPTH):
            queries = server.take(DEPTH)
            assert server.is_idle()
            for query in queries:
                server.reply(query)
        assert [call.result(TIMEOUT).sum for call in calls] == [*range(1, CALLS + 1)]


def test_a_call_that_waits_for_its_turn(client: Client, server: DroppingServer) -> None:
    with ThreadPoolExecutor(DEPTH + 1) as pool:
        calls = [pool.submit(client, number, 1) for number in range(DEPTH)]
        queries = server.take(DEPTH)
        with pytest.raises(WaitTimeout, match="no answer of service '/add'"):
            client(1, 1, timeout=0.1)
        waiting = pool.submit(client, 1, 1)
        client.close()
        for call in (*calls, waiting):
            with pytest.raises(ClosedError):
                call.result(TIMEOUT)
        for query in queries:
            query.drop()


def test_the_error_tells_that_the_request_was_dropped(
    client: Client, server: DroppingServer
) -> None:
    with ThreadPoolExecutor(1) as pool:
        call = pool.submit(client, 1, 1)
        # One that is dropped at once, as if no route led to a server yet, is sent again.
        eventually(lambda: not server.drop() and call.done(), "the end of the call")
        with pytest.raises(ServiceError, match="/adder dropped the request unanswered: it keeps"):
            call.result(TIMEOUT)
