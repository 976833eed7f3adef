"""Marks of the living: seen before there is a link, gone with their process."""

from __future__ import annotations

import re
import signal

import pytest
from network import Network

from rosz.errors import TransportError
from rosz.session import Session, SessionConfig
from rosz.session.presence import is_anybody_awake

OLD = """
    import sys
    import rosz
    with rosz.Node(sys.argv[1]) as node:
        node.params.set(f"/from/{sys.argv[1]}", 1)
        print("up")
        node.spin()
"""
NEW = """
    import rosz
    with rosz.Node("new") as node:
        print("read", sorted(node.params.get("/from", {})))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=["killed", "ended"])
def test_marks_end_with_their_process(network: Network, number: signal.Signals) -> None:
    assert not is_anybody_awake(network.rendezvous)
    program = network.program(OLD, "a")
    program.wait_for("up")
    assert is_anybody_awake(network.rendezvous)
    program.send(number)
    program.exit_code()
    assert not is_anybody_awake(network.rendezvous)


def test_a_newcomer_right_after_the_death_of_the_first(network: Network) -> None:
    """It is the meeting point now, and nobody has found it yet; still it finds what there is."""
    programs = {}
    for name in ("first", "second", "third"):
        programs[name] = network.program(OLD, name)
        programs[name].wait_for("up")
    programs["first"].kill()
    newcomer = network.program(NEW)
    assert newcomer.wait_for("read") == "read ['first', 'second', 'third']"


def test_a_second_router_of_a_process_is_refused(network: Network) -> None:
    config = SessionConfig(mode="router", rendezvous=network.rendezvous)
    with Session.open(config):
        told = rf"has a router at {re.escape(network.rendezvous)} already.*: close that one first"
        with pytest.raises(TransportError, match=told):
            Session.open(config)
    Session.open(config).close()
