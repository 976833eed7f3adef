"""A token that this session declares, and that others declared as well."""

from __future__ import annotations

from queue import SimpleQueue

from network import TIMEOUT, Network

from rosz.session import SessionConfig


def test_an_own_token_does_not_disappear_with_the_one_of_another(network: Network) -> None:
    far = f"unixsock-stream/{network.folder}/far.sock"
    network.session(SessionConfig(mode="router", rendezvous=network.rendezvous))
    network.session(SessionConfig(mode="router", rendezvous=far, connect=(network.rendezvous,)))
    events: SimpleQueue[tuple[str, bool]] = SimpleQueue()
    session = network.session()
    watch = session.watch_tokens("k/*", lambda key, alive: events.put((key, alive)))
    own = session.token("k/1")
    assert events.get(timeout=TIMEOUT) == ("k/1", True)
    other = network.session(SessionConfig(mode="client", rendezvous=far))
    other.token("k/1").close()
    last = other.token("k/2")
    assert events.get(timeout=TIMEOUT) == ("k/2", True)
    own.close()
    assert events.get(timeout=TIMEOUT) == ("k/1", False)
    last.close()
    watch.close()
