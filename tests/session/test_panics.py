"""Keys that would make Zenoh panic are refused; a panic ends what it must, and is said once."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import InvalidName
from rosz.session import Query, Session

LONG = "a/" + "x" * 66_000
CALLS: dict[str, Callable[[Session, str], object]] = {
    "put": lambda session, key: session.put(key, b""),
    "delete": lambda session, key: session.delete(key),
    "publisher": lambda session, key: session.publisher(key),
    "publisher with a cache": lambda session, key: session.publisher(key, cache=1),
    "subscriber": lambda session, key: session.subscriber(key, print),
    "rare subscriber": lambda session, key: session.subscriber(key, print, rare=True),
    "subscriber with history": lambda session, key: session.subscriber(key, print, history=1),
    "pull_subscriber": lambda session, key: session.pull_subscriber(key, 1),
    "queue_subscriber": lambda session, key: session.queue_subscriber(key, 1, print),
    "queryable": lambda session, key: session.queryable(key, print),
    "pull_queryable": lambda session, key: session.pull_queryable(key),
    "get": lambda session, key: session.get(key, timeout=1),
    "querier": lambda session, key: session.querier(key, timeout=1),
    "token": lambda session, key: session.token(key),
    "watch_tokens": lambda session, key: session.watch_tokens(key, print),
    "live_tokens": lambda session, key: session.live_tokens(key, 1),
}
PANIC = """
    from rosz.node import Context
    from rosz.errors import PanicError
    from rosz.session.declared import translate_errors

    with Context() as context, Context() as other:
        session = context.session
        while not session.peers():
            pass
        try:
            with translate_errors("subscribe"):
                session._raw.declare_subscriber("x" * 66_000)
        except PanicError as error:
            print(error)
"""


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_keys_that_are_too_long(network: Network, call: Callable[[Session, str], object]) -> None:
    one, other = network.session(), network.session()
    with pytest.raises(InvalidName, match="it has 66002 bytes; the limit is 32768"):
        call(one, LONG)
    one.put("a/b", b"")
    other.put("a/b", b"")


def test_replies_with_a_key_that_is_too_long(network: Network) -> None:
    one, other = network.session(), network.session()
    refused = []

    def answer(query: Query) -> None:
        with query:
            try:
                query.reply(LONG, b"")
            except InvalidName as error:
                refused.append(str(error))
            query.reply("a/b", b"2")

    served = one.queryable("a/b", answer)

    def payloads() -> list[bytes]:
        return [reply.payload for reply in other.get("a/b", timeout=TIMEOUT)]

    eventually(lambda: payloads() == [b"2"], "a route to the queryable")
    served.close()
    assert "the limit is 32768" in refused[0]


def test_a_panic_ends_the_operation_and_a_lost_session_the_program(network: Network) -> None:
    program = network.program(f"""{PANIC}
        session.put("a", b"")
        print("goes on")
    """)
    assert program.exit_code() == 1
    said = [line for line in program.lines if line.startswith("cannot subscribe: Zenoh panicked")]
    lost = [line for line in program.lines if "the network of this program is lost" in line]
    assert (len(said), len(lost)) == (1, 1)
    assert "goes on" not in program.lines


def test_a_program_that_starts_afresh_when_its_session_is_lost(network: Network) -> None:
    """It is not ended: `rosz core` hands its parameters over."""
    program = network.program(f"""{PANIC}
        import os
        from rosz.session import on_loss
        on_loss(lambda why: print("afresh:", why))
        for _ in range(2):
            try:
                session.put("a", b"")
            except PanicError:
                print("refused")
        os._exit(0)
    """)
    assert program.exit_code() == 0
    assert [line.partition(":")[0] for line in program.lines if line[:2] in {"af", "re"}] == [
        "afresh",
        "refused",
        "refused",
    ]
