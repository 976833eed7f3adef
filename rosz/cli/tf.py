"""``rosz tf``: list, print, watch and publish transforms."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

from rosz.cli.call import Call, new_group
from rosz.cli.console import print_json, print_json_line, print_lines, print_result, warn
from rosz.cli.declare import Argument, Json, Option, at_least, per_second, seconds, values_last
from rosz.errors import TransformError

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.transforms import Monitor

__all__ = ("app",)

app = new_group("List, print, watch and publish transforms.")

_TOOL = "rosz_tf"
_TOLD_AFTER = 2_000_000_000
"""Nanoseconds after which it is told what the command waits for."""

_Wait = Annotated[float, Option("--wait SECONDS", "How long to listen to /tf.")]
_Target = Annotated[str, Argument("TARGET", "Frame to give coordinates in.")]
_Source = Annotated[str, Argument("SOURCE", "Frame whose pose is wanted.")]


def _monitored(node: Node, wait: float) -> Monitor:
    """Return a monitor that has listened for a time."""
    from rosz.transforms import Monitor

    monitor = Monitor(node)
    time.sleep(wait)
    return monitor


@app.command("list")
def list_command(call: Call, *, wait: _Wait = 1.0, json: Json = False) -> int:
    """List frames with their parents, and by whom and how often they are published."""
    seconds("--wait", wait)
    with call.lasting_node(_TOOL) as node:
        found = _monitored(node, wait).frames()
        lines = (
            f"{one.frame} in {one.parent}, "
            + ("static" if one.static else f"{one.rate:.1f} Hz")
            + (f", from {one.node}" if one.node else "")
            for one in found
        )
        print_result(lines, found, as_json=json)
        return int(not found)
    return 1


@app.command("tree")
def tree_command(
    call: Call,
    *,
    wait: _Wait = 1.0,
    dot: Annotated[bool, Option("--dot", "Print it in the language of Graphviz.")] = False,
) -> int:
    """Print the tree of frames."""
    seconds("--wait", wait)
    from rosz.transforms import tree_as_dot, tree_as_text

    with call.lasting_node(_TOOL) as node:
        found = _monitored(node, wait).frames()
        print_lines([tree_as_dot(found, wait).rstrip()] if dot else tree_as_text(found))
        return int(not found)
    return 1


@app.command("echo")
def echo_command(
    call: Call,
    target: _Target,
    source: _Source,
    *,
    rate: Annotated[float, Option("-r --rate HZ", "Lines per second.")] = 1.0,
    count: Annotated[int | None, Option("-n COUNT", "End after so many transforms.")] = None,
    timeout: Annotated[
        float, Option("--timeout SECONDS", "How long to wait for the first transform.")
    ] = 3600.0,
    json: Json = False,
) -> int:
    """Print the pose of a frame in another one, again and again."""
    seconds("--timeout", timeout)
    per_second("--rate", rate)
    at_least("-n", count, 1, "transforms")
    from rosz.node import Clock
    from rosz.transforms import Buffer, TransformListener, describe_pose

    with call.lasting_node(_TOOL) as node:
        buffer = Buffer()
        TransformListener(buffer, node)
        limit = round(timeout * 1e9)

        def known() -> bool:
            return not buffer.why_not(target, source)

        if limit > _TOLD_AFTER and not buffer.wait(known, _TOLD_AFTER, Clock()):
            warn(f"waiting for the transform: {buffer.why_not(target, source)}")
            limit -= _TOLD_AFTER
        if not buffer.wait(known, limit, Clock()):
            raise TransformError(buffer.why_not(target, source))
        shown = 0
        while True:
            pose, stamp = buffer.lookup(target, source)
            if json:
                print_json_line(
                    {"stamp": stamp, "translation": pose.translation, "rotation": pose.rotation}
                )
            else:
                print_lines(describe_pose(pose, stamp))
            shown += 1
            if shown == count:
                return 0
            time.sleep(1 / rate)
    return 0


@app.command("monitor")
def monitor_command(
    call: Call,
    *,
    period: Annotated[float, Option("--period SECONDS", "Time between two reports.")] = 1.0,
    count: Annotated[int | None, Option("-n COUNT", "End after so many reports.")] = None,
    json: Json = False,
) -> int:
    """Print again and again how often and how late transforms arrive."""
    seconds("--period", period)
    at_least("-n", count, 1, "reports")
    from rosz.transforms import Monitor

    with call.lasting_node(_TOOL) as node:
        monitor = Monitor(node)
        shown = 0
        while True:
            time.sleep(period)
            frames, nodes = monitor.frames(), monitor.broadcasters()
            if json:
                print_json({"frames": frames, "broadcasters": nodes})
            else:
                print_lines(_report(frames, nodes))
            shown += 1
            if shown == count:
                return 0
    return 0


def _report(frames: list[Any], nodes: list[Any]) -> list[str]:
    def figures(one: Any) -> str:
        return f"{one.rate:8.1f} Hz, delay {one.mean_delay:.3f} s, at most {one.max_delay:.3f} s"

    lines = [f"{one.frame:24} {'static' if one.static else figures(one)}" for one in frames]
    return [*lines, *(f"from {one.node or 'unknown':19} {figures(one)}" for one in nodes), "---"]


@app.command("publish", arrange=values_last())
def publish_command(
    call: Call,
    values: Annotated[
        list[str],
        Argument(
            "VALUE",
            "X Y Z YAW PITCH ROLL PARENT CHILD in metres and radians, or X Y Z QX QY QZ QW PARENT"
            " CHILD.",
        ),
    ],
) -> None:
    """Publish a static transform until stopped."""
    from rosz.msgs.builtin_interfaces.msg import Time
    from rosz.programs.tf import parse_transform
    from rosz.transforms import StaticTransformBroadcaster

    transform = parse_transform(values)
    with call.lasting_node(_TOOL) as node:
        transform.header.stamp = Time.from_nsec(node.now())
        StaticTransformBroadcaster(node).send(transform)
        print_lines([f"publishing {transform.child_frame_id} in {transform.header.frame_id}"])
        node.spin()
