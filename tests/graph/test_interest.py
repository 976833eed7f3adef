"""A node follows the names that it uses, and the whole domain only if somebody needs that."""

from __future__ import annotations

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import WaitTimeout
from rosz.graph import Graph
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import Node
from rosz.wire import Kind, Token, format_token, is_rosz_id


def followed_names(graph: Graph) -> set[str]:
    """Return the names of all tokens that a graph has received."""
    tokens = [token for one in graph._interests.all() for token in one.tokens.values()]
    return {token.name if isinstance(token, Token) else token.node for token in tokens}


def test_a_node_hears_of_its_own_names_only(network: Network) -> None:
    others = [network.node(f"other{number}") for number in range(5)]
    for other in others:
        other.publisher("scan", String)
        other.service("~reset", Empty, lambda _: None)
    node = network.node("robot")
    subscription = node.subscription("scan", String)
    client = node.client("other3/reset", Empty)
    eventually(lambda: len(subscription.publishers()) == 5, "all publishers")
    client.wait_for_service(TIMEOUT)
    own = {"/scan", "/other3/reset", "/robot"}
    assert followed_names(node.context.graph) <= own
    node.publisher("command", String)
    others[0].subscription("command", String)
    eventually(lambda: "/command" in followed_names(node.context.graph), "the subscription")
    assert followed_names(node.context.graph) <= own | {"/command"}
    eventually(lambda: len(node.context.graph.view().publishers("/rosout")) == 6, "all logs")


def test_what_existed_is_known_once_it_is_complete(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosz.graph.interests.COMPLETE_BY", TIMEOUT)
    host = network.context()
    node = network.node("robot", context=host)
    for _ in range(50):
        node.publisher("scan", String)
    for _ in range(5):
        graph = network.context().graph
        with graph.follow_entities(Kind.PUBLISHER, "/scan") as followed:
            followed.wait_for(bool, TIMEOUT, "all that existed")
            assert len(followed.view().publishers("/scan")) == 50


def test_the_watch_ends_with_its_last_user(network: Network) -> None:
    graph = network.context().graph
    one = graph.follow_entities(Kind.SERVICE, "/reset")
    other = graph.follow_entities(Kind.SERVICE, "/reset")
    (interest,) = graph._interests.all()
    one.close()
    one.close()
    assert graph._interests.all() == [interest]
    other.close()
    assert not graph._interests.all()


def test_names_of_a_whole_domain_need_no_watch(network: Network) -> None:
    """A watch costs a thread, which wakes ten times a second."""
    other = network.node("other")
    early = other.subscription("scan", String)
    node = network.node("robot")
    graph = node.context.graph
    eventually(lambda: graph.view().subscriptions("/scan"), "the subscription")
    watches = {one.key for one in graph._interests.all() if not one.is_part}
    publishers = [node.publisher(name, String) for name in ("scan", "command")]
    assert {one.key for one in graph._interests.all() if not one.is_part} == watches
    heard: list[tuple[str, bool]] = []
    for publisher in publishers:
        publisher.others.listen(lambda token, alive: heard.append((token.name, alive)))
    eventually(lambda: heard == [("/scan", True)], "what existed")
    late = other.subscription("command", String)
    eventually(lambda: heard[1:] == [("/command", True)], "what came later")
    assert [len(one.subscribers()) for one in publishers] == [1, 1]
    early.close()
    late.close()
    eventually(lambda: heard[2:] == [("/scan", False), ("/command", False)], "their ends")
    assert not any(one.subscribers() for one in publishers)
    publishers[0].close()
    assert len([one for one in graph._interests.all() if one.name == "/scan"]) == 0


def test_a_newer_node_takes_over_in_a_process_that_follows_all(network: Network) -> None:
    older = network.node("robot")
    other = network.node("other", context=older.context)
    other.context.graph.view()
    twin = network.node("twin", context=older.context)
    network.node("twin")
    eventually(lambda: twin.is_shutdown, "the older's end")
    assert not older.is_shutdown


def test_who_follows_later_finds_what_came_meanwhile(network: Network) -> None:
    graph = network.node("robot").context.graph
    graph.follow_entities(Kind.SERVICE, "/reset").close()
    server = network.node("server").service("reset", Empty, lambda _: None)
    assert graph.wait_for_service("/reset", TIMEOUT).servers("/reset")
    server.close()
    with graph.follow_entities(Kind.SERVICE, "/reset") as followed:
        followed.wait_for(lambda view: not view.servers("/reset"), TIMEOUT, "its end")


def test_a_name_without_its_first_slash(network: Network) -> None:
    """Other participants than ROS 2 leave it out."""
    node = network.node("robot")
    subscription = node.subscription("scan", String)
    token = Token(
        *(network.domain, "abc", 0, 1, Kind.PUBLISHER, "/", "foreign", "/"),
        name="/scan",
        type_name=String._type_name,
        type_hash=String._type_hash,
        qos=subscription.qos,
    )
    session = network.session()
    kept = [session.token(format_token(token).replace("%scan", "scan"))]
    eventually(lambda: len(subscription.publishers()) == 1, "the publisher")
    longer = format_token(token).replace("%scan", "%laser_scan").replace("abc", "abd")
    kept.append(session.token(longer))
    node.context.graph.wait_for_topic("/laser_scan", TIMEOUT)
    assert followed_names(node.context.graph) == {"/scan", "/robot"}


@pytest.mark.parametrize("name", ["/no*thing", "/**", "/what?", "", "/", "/a$*"])
def test_waiting_for_a_name_that_none_can_have(network: Network, name: str) -> None:
    node = network.node("robot")
    node.publisher("nothing", String)
    with pytest.raises(WaitTimeout):
        node.context.graph.wait_for_topic(name, 0.01)


def test_every_session_has_an_id_of_rosz(network: Network) -> None:
    nodes = [network.node("peer"), Node("client", context=network.context(mode="client"))]
    assert all(is_rosz_id(node.context.session.zid) for node in nodes)
