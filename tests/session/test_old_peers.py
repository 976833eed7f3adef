"""A router that starts after peers of an older Zenoh."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from cached import old_zenoh
from network import Network, Program, eventually
from upstream.dropped_tokens import PEER

from rosz.session import Router, Session, SessionConfig

NODE = "@ros2_lv/42/ZID/0/0/NN/%/%/"


class OldPeer:
    """A process that dials the meeting point with an old Zenoh, and has the token of a node."""

    def __init__(self, network: Network, name: str) -> None:
        command = [str(old_zenoh()), "-c", PEER, network.rendezvous, NODE + name]
        self.program = Program(command, {"PATH": "/usr/bin:/bin"})
        self.zid = self.program.wait_for("up").split()[1]
        self.token = (NODE + name).replace("ZID", self.zid)


@pytest.fixture
def peers(network: Network) -> Iterator[list[OldPeer]]:
    """Two of them, of which nobody knows yet."""
    started = [OldPeer(network, "one"), OldPeer(network, "two")]
    yield started
    for peer in started:
        peer.program.close()


def _live_tokens(session: Session) -> set[str]:
    return set(session.live_tokens("@ros2_lv/**", 5))


def test_clients_of_a_later_router_see_the_tokens(network: Network, peers: list[OldPeer]) -> None:
    first, second = peers
    with Router(network.environment()) as router:
        client = network.session(SessionConfig(mode="client", rendezvous=network.rendezvous))
        both = {first.token, second.token}
        eventually(lambda: _live_tokens(client) == both, "the tokens of both")
        first.program.say("undeclare")
        first.program.wait_for("undeclared")
        eventually(lambda: _live_tokens(client) == {second.token}, "one token is gone")
        late = OldPeer(network, "late")
        try:
            eventually(lambda: late.token in _live_tokens(client), "a newcomer")
        finally:
            late.program.close()
        second.program.kill()
        eventually(lambda: not _live_tokens(client), "all tokens are gone")
        assert first.zid in router.session.peers()
