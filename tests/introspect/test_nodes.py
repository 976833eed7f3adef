"""A reply that cannot be decoded is an error that names the node."""

from __future__ import annotations

from contextlib import closing

import pytest
from network import Network

from rosz.errors import RoszError
from rosz.introspect.nodes import get_info
from rosz.node.control import control_key
from rosz.session import Query
from rosz.wire import Kind, Token

NUMBER = 99


def test_a_reply_that_cannot_be_decoded(network: Network) -> None:
    session = network.context().session
    key = control_key(network.domain, session.zid, NUMBER)

    def answer(query: Query) -> None:
        with query:
            query.reply(key, b"\xc1")

    token = Token(network.domain, session.zid, NUMBER, NUMBER, Kind.NODE, "/", "odd")
    with (
        closing(session.queryable(key, answer)),
        pytest.raises(RoszError, match=r"'/odd' sends a reply that cannot be decoded: .*version"),
    ):
        get_info(network.context().session, token)
