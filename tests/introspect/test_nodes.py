"""Nodes that answer what makes no sense are told by name."""

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


def test_an_answer_that_makes_no_sense(network: Network) -> None:
    session = network.context().session
    key = control_key(network.domain, session.zid, NUMBER)

    def answer(query: Query) -> None:
        with query:
            query.reply(key, b"\xc1")

    token = Token(network.domain, session.zid, NUMBER, NUMBER, Kind.NODE, "/", "odd")
    with (
        closing(session.queryable(key, answer)),
        pytest.raises(RoszError, match=r"node '/odd' answers what makes no sense: .*version"),
    ):
        get_info(network.context().session, token)
