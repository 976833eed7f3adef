"""What pages observe, without pages: it is open only while they use it."""

from __future__ import annotations

import pytest
from network import Network, eventually

from rosz.access import PagePolicy
from rosz.errors import UsageError
from rosz.msgs.sensor_msgs.msg import Image
from rosz.msgs.std_msgs.msg import String
from rosz.security import Permit
from rosz.web.model import SharedResource, System
from rosz.wire import Kind


class _Door:
    def __init__(self) -> None:
        self.closed = False

    def close(self) -> None:
        self.closed = True


def test_the_last_user_closes_what_the_first_one_opened() -> None:
    shared = SharedResource(_Door)
    first, second = shared.use(), shared.use()
    door = first.value
    assert second.value is door
    first.close()
    first.close()
    assert not door.closed
    second.close()
    assert door.closed
    third = shared.use()
    assert third.value is not door
    assert not third.value.closed


def test_a_page_that_is_read_only_says_so() -> None:
    with pytest.raises(UsageError, match="this page is read-only: it may not publish '/a'"):
        PagePolicy(read_only=True).check("publish", "/a")
    PagePolicy(read_only=True).check("subscribe", "/a")
    with pytest.raises(UsageError, match="the rules of this machine do not let"):
        PagePolicy(Permit()).check("set", "/a")
    with pytest.raises(UsageError, match="control '/robot'"):
        PagePolicy(Permit()).check_control("control '/robot'")


def test_topics_are_measured_while_somebody_looks(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    chatter, camera = robot.publisher("chatter", String), robot.publisher("camera", Image)
    system = System(page, PagePolicy())
    graph, traffic = system.graph.use(), system.traffic.use()

    def measured() -> set[str]:
        traffic.value.update(graph.value.survey())
        return {one for one in ("/chatter", "/camera") if one in traffic.value._taps}

    eventually(lambda: measured() == {"/chatter"}, "only the light topic is measured")

    def flows() -> bool:
        chatter.publish(String(data="x" * 100))
        return traffic.value.flow("/chatter") is not None

    eventually(flows, "the rate of a topic")
    flow = traffic.value.flow("/chatter")
    assert flow is not None
    assert flow.rate > 0
    assert 100 <= flow.size <= 120
    traffic.value.everything = True
    eventually(lambda: measured() == {"/chatter", "/camera"}, "both topics are measured")
    with robot.context.graph.follow_all() as followed:
        eventually(lambda: len(_own(followed.view().tokens, page.name)) == 2, "two subscriptions")
        traffic.close()
        graph.close()
        eventually(lambda: not _own(followed.view().tokens, page.name), "no subscription is left")
    assert not any(getattr(part, "_users", 0) for part in vars(system).values())
    camera.close()


def _own(tokens: tuple[object, ...], node: str) -> list[object]:
    return [
        one
        for one in tokens
        if getattr(one, "node_name", "") == node
        and getattr(one, "kind", None) is Kind.SUBSCRIPTION
        and getattr(one, "name", "") in {"/chatter", "/camera"}
    ]
