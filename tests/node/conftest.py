"""Nodes that several files of tests use."""

from __future__ import annotations

import pytest
from network import Network

from rosz.node import Node


@pytest.fixture
def talker(network: Network) -> Node:
    return network.node("talker")


@pytest.fixture
def listener(network: Network) -> Node:
    return network.node("listener")


@pytest.fixture
def server(network: Network) -> Node:
    return network.node("server")


@pytest.fixture
def caller(network: Network) -> Node:
    return network.node("caller")
