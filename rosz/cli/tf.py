"""``rosz tf``: list, print, watch and publish transforms."""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING, Annotated, Any

from rosz.cli.call import Call, new_group
from rosz.cli.console import print_json_line, print_lines, print_result, warn
from rosz.cli.declare import Argument, Json, Option, at_least, per_second, seconds, values_last
from rosz.errors import TransformError

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.transforms import Monitor

app = new_group("List, print, watch and publish transforms.")

_TOOL = "rosz_tf"
_TOLD_AFTER = 2_000_000_000
"""Nanoseconds after which a warning says why the command waits."""

_Wait = Annotated[float, Option("--wait SECONDS", "How long to listen to /tf.")]
_Target = Annotated[str, Argument("TARGET", "Frame to give coordinates in.")]
_Source = Annotated[str, Argument("SOURCE", "Frame whose pose is wanted.")]


def _monitored(node: Node, wait: float) -> Monitor:
    from rosz.transforms import Monitor

    monitor = Monitor(node)
    time.sleep(wait)
    return monitor


@app.command("list")
def list_command(call: Call, *, wait: _Wait = 1.0, json: Json = False) -> int:
    """List frames with their parents, and by whom and how often they are published."""
    seconds("--wait", wait)
    from rosz.transforms import describe_other_parents

    with call.lasting_node(_TOOL) as node:
        frames = _monitored(node, wait).frames()
        lines = (
            f"{frame.frame} in {frame.parent}, "
            + ("static" if frame.static else f"{frame.rate:.1f} Hz")
            + (f", from {frame.node}" if frame.node else "")
            + describe_other_parents(frame)
            for frame in frames
        )
        print_result(lines, frames, as_json=json)
        return int(not frames)
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
        frames = _monitored(node, wait).frames()
        print_lines([tree_as_dot(frames, wait).rstrip()] if dot else tree_as_text(frames))
        return int(not frames)
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
        for shown in itertools.count(1):
            pose, stamp = buffer.lookup(target, source)
            if json:
                print_json_line(
                    {"stamp": stamp, "translation": pose.translation, "rotation": pose.rotation}
                )
            else:
                print_lines(describe_pose(pose, stamp))
            if shown == count:
                break
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
        for shown in itertools.count(1):
            time.sleep(period)
            frames, nodes = monitor.frames(), monitor.broadcasters()
            row = {"frames": frames, "broadcasters": nodes}
            print_result(_report(frames, nodes), row, as_json=json)
            if shown == count:
                break
    return 0


def _report(frames: list[Any], nodes: list[Any]) -> list[str]:
    def figures(row: Any) -> str:
        return f"{row.rate:8.1f} Hz, delay {row.mean_delay:.3f} s, at most {row.max_delay:.3f} s"

    lines = [f"{frame.frame:24} {'static' if frame.static else figures(frame)}" for frame in frames]
    return [*lines, *(f"from {node.node or 'unknown':19} {figures(node)}" for node in nodes), "---"]


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
