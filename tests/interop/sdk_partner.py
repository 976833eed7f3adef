"""The other side, played by zenoh-ros2-sdk: it does what it is told, line by line, and answers.

Usage: sdk_partner.py PORT DOMAIN INTERFACES
"""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zenoh_ros2_sdk as sdk  # type: ignore[import-untyped]

PORT, DOMAIN = int(sys.argv[1]), int(sys.argv[2])
PLACE: dict[str, Any] = {"router_port": PORT, "domain_id": DOMAIN}
KEPT: list[Any] = []
PUBLISHERS: dict[str, Any] = {}


def say(**answer: object) -> None:
    print(json.dumps(answer), flush=True)


def echo(source: str, target: str, kind: str) -> None:
    """Publish again, decoded and encoded by the SDK, what comes."""
    publisher = sdk.ROS2Publisher(target, kind, node_name="sdk_echo", **PLACE)

    def again(message: Any) -> None:
        fields = {f.name: getattr(message, f.name) for f in dataclasses.fields(message)}
        publisher.publish(**{n: v for n, v in fields.items() if not n.startswith("__")})

    KEPT.append(sdk.ROS2Subscriber(source, kind, again, node_name="sdk_echo", **PLACE))
    PUBLISHERS[target] = publisher
    say(echo=source)


def matched(target: str) -> None:
    """Tell whether what it publishes on a topic reaches a subscription."""
    say(matched=bool(PUBLISHERS[target].pub.matching_status.matching))


def serve(name: str) -> None:
    kind = "example_interfaces/srv/AddTwoInts"

    def add(request: Any) -> Any:
        if request.a < 0:
            raise ValueError("nothing below zero")
        return server.response_msg_class(sum=request.a + request.b)

    server = sdk.ROS2ServiceServer(name, kind, add, node_name="sdk_server", **PLACE)
    KEPT.append(server)
    say(serve=name)


def call(name: str, a: int, b: int) -> None:
    kind = "example_interfaces/srv/AddTwoInts"
    client = sdk.ROS2ServiceClient(name, kind, node_name="sdk_client", timeout=50.0, **PLACE)
    answer: Any = client.call(a=a, b=b)
    say(sum=None if answer is None else answer.sum)
    client.close()


def types_of(node: str, names: list[str]) -> None:
    """Ask for the types of parameters: of those services the only one that the SDK can decode."""
    kind = "rcl_interfaces/srv/GetParameterTypes"
    service = f"{node}/get_parameter_types"
    client = sdk.ROS2ServiceClient(service, kind, node_name="sdk_client", timeout=50.0, **PLACE)
    answer: Any = client.call(names=names)
    say(types=None if answer is None else list(map(int, answer.types)))
    client.close()


def see() -> None:
    """Tell what its discovery shows."""
    say(
        topics=dict(sdk.get_topic_names_and_types(**PLACE)),
        services=dict(sdk.get_service_names_and_types(**PLACE)),
    )


def inspect(topic: str) -> None:
    info = sdk.get_topic_info(topic, verbose=True, **PLACE)  # None for a topic that is not known
    ends = (info.publishers, info.subscribers) if info else ((), ())
    publishers, subscriptions = (
        [[one.node_namespace, one.node_name, one.topic_type] for one in some] for some in ends
    )
    say(publishers=publishers, subscriptions=subscriptions)


def main() -> None:
    sdk.get_registry().messages_dir = Path(sys.argv[3])
    commands: dict[str, Callable[..., None]] = {
        "echo": echo,
        "matched": matched,
        "serve": serve,
        "call": call,
        "types": types_of,
        "see": see,
        "inspect": inspect,
    }
    say(ready=True)
    for line in sys.stdin:
        name, *arguments = json.loads(line)
        commands[name](*arguments)


main()
