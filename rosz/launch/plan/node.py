"""``<node>``, ``<test>``, ``<executable>``: the processes of a launch."""

from __future__ import annotations

import math
import re
from typing import Literal

from msgspec.structs import replace

from rosz import names
from rosz.launch.plan.fault import TextFault
from rosz.launch.plan.ledger import Ledger
from rosz.launch.plan.model import NodePlan, TestPlan
from rosz.launch.plan.param import read_param, read_rosparam
from rosz.launch.plan.scope import Scope, join
from rosz.launch.plan.tag import Tag
from rosz.launch.plan.tags import misplaced
from rosz.launch.plan.waiting import read_wait

__all__ = ("namespace", "read_executable", "read_node", "read_test")

_DEFAULT_TIME_LIMIT = 60.0


def namespace(tag: Tag) -> str | None:
    """Return ``ns``, None where it is absent.

    Raises:
        Fault: It is empty.
    """
    ns = tag.alias("ns", "namespace")
    if ns is not None and not ns:
        tag.fail("'ns' is empty; leave it out, or write '/' for the root", "ns")
    return ns


def read_node(tag: Tag, ledger: Ledger) -> None:
    """Read ``<node>``.

    With ROS 2's ``exec`` in place of ``type`` the name may be left out; it is then that of the
    executable, where ROS 2 leaves it to the program.

    Raises:
        Fault: An attribute or a tag inside is wrong, or another node has the name.
    """
    tag.check()
    if "name" in tag.element.attributes or "type" in tag.element.attributes:
        name = tag.require("name")
    else:
        name = _legal(tag.require("type", "exec").partition(".")[0])
    node = _node(tag, ledger, name)
    try:
        ledger.add_node(node)
    except TextFault as fault:
        tag.fail(fault.reason, "name")


def read_test(tag: Tag, ledger: Ledger) -> None:
    """Read ``<test>``.

    Raises:
        Fault: An attribute or a tag inside is wrong.
    """
    for attribute in ("respawn", "respawn_delay", "output"):
        if attribute in tag.element.attributes:
            tag.fail(f"a <test> cannot have '{attribute}'", attribute)
    tag.check()
    test_name = tag.require("test-name")
    name = tag.get("name") or test_name
    limit = _DEFAULT_TIME_LIMIT
    if tag.get("time-limit"):
        limit = tag.number("time-limit", limit)
        if limit <= 0:
            tag.fail(f"'time-limit' is '{limit:g}'; expected more than 0 seconds", "time-limit")
    retry = tag.whole("retry", 0, -math.inf) or 0
    # The runner of tests ends with each of them, so 'required' says nothing there.
    node = replace(_node(tag, ledger, name), required=False)
    ledger.add_test(TestPlan(node, test_name, limit, retry))


def read_executable(tag: Tag, ledger: Ledger) -> None:
    """Read ROS 2's ``<executable>``: a program that is no ROS node.

    ``cmd`` is split as a shell does and not given to one. ``shell`` is not supported.

    Raises:
        Fault: An attribute or a tag inside is wrong, or another process has the name.
    """
    tag.check()
    tag.require("cmd")
    command = tag.words("cmd")
    if not command:
        tag.fail("'cmd' is empty", "cmd")
    scope = tag.scope.child()
    for element in tag.element.children:
        inner = tag.inside(element, scope)
        if inner.name == "env" and inner.wanted():
            inner.env(scope)
        elif inner.name != "env":
            inner.warn(misplaced(element.tag, "executable"))
    name = tag.get("name")
    base = ledger.free_name(scope.ns, _legal(command[0].rpartition("/")[2]))
    respawn, required = _fates(tag)
    node = NodePlan(
        package="",
        type="",
        command=command,
        name=name or base,
        named=bool(name),
        namespace=names.canonical(scope.ns),
        place=tag.place,
        args=tag.words("args"),
        launch_prefix=tag.words("launch-prefix"),
        respawn=respawn,
        respawn_delay=tag.number("respawn_delay", 0.0),
        respawn_max=tag.whole("respawn_max", None, 0),
        required=required,
        output=_output(tag) or "log",
        cwd=tag.get("cwd") or "ROS_HOME",
        env=tuple(scope.env),
        wait_for=(*scope.waits, *read_wait(tag, scope.ns, name or base)),
        spawn_delay=tag.number("spawn_delay", 0.0, 0.0),
    )
    try:
        ledger.add_node(node)
    except TextFault as fault:
        tag.fail(fault.reason, "name")


def _node(tag: Tag, ledger: Ledger, name: str) -> NodePlan:
    if not names.is_valid(name):
        tag.warn(f"'{name}' is no legal name; other tools will stumble over it", "name")
    own, params = _scopes(tag, ledger, name)
    package = tag.require("pkg")
    type_name = tag.alias("type", "exec")
    if type_name is None:
        type_name = tag.require("type")
    _refuse_empty(tag, package, type_name, name)
    respawn, required = _fates(tag)
    node = NodePlan(
        package=package,
        type=type_name,
        name=name or ledger.context.anonymous(_legal(type_name)),
        named=bool(name),
        namespace=names.canonical(own.ns),
        place=tag.place,
        machine=tag.get("machine") or ledger.default_machine,
        args=tag.split("args", tag.again("args")),
        launch_prefix=tag.words("launch-prefix"),
        respawn=respawn,
        respawn_delay=tag.number("respawn_delay", 0.0),
        respawn_max=tag.whole("respawn_max", None, 0),
        required=required,
        output=_output(tag) or "log",
        cwd=_cwd(tag),
        wait_for=(*tag.scope.waits, *read_wait(tag, own.ns, name)),
        spawn_delay=tag.number("spawn_delay", 0.0, 0.0),
    )
    remaps, env = tag.scope.child(), tag.scope.child()
    _read_inside(tag, ledger, params, remaps, env)
    _settle_private(tag, ledger, params)
    return replace(node, remaps=tuple(remaps.remaps), env=tuple(env.env))


def _scopes(tag: Tag, ledger: Ledger, name: str) -> tuple[Scope, Scope]:
    """Open the scope of a node and that of its params."""
    ns = namespace(tag)
    if name.startswith("~"):
        tag.fail(f"node name '{name}' starts with '~', as only names within a node do", "name")
    try:
        own = tag.scope.child(ns)
        params = own.child(name)
    except TextFault as fault:
        tag.fail(fault.reason, "ns" if ns else "name")
    params.private = []
    if tag.get("clear_params") and tag.flag("clear_params"):
        if not name:
            tag.fail("'clear_params' needs a node with a name", "clear_params")
        ledger.clear(join(own.ns, name))
    return own, params


def _read_inside(tag: Tag, ledger: Ledger, params: Scope, remaps: Scope, env: Scope) -> None:
    for element in tag.element.children:
        outer = tag.inside(element, tag.scope)
        match outer.name:
            case "remap":
                if outer.wanted():
                    outer.remap(remaps)
            case "param":
                inner = tag.inside(element, params)
                if inner.wanted():
                    read_param(inner, ledger, in_node=True)
            case "rosparam":
                inner = tag.inside(element, params)
                if inner.wanted():
                    read_rosparam(inner, ledger)
            case "env":
                inner = tag.inside(element, env)
                if inner.wanted():
                    inner.env(env)
            case _:
                outer.warn(misplaced(element.tag, tag.name))


def _settle_private(tag: Tag, ledger: Ledger, params: Scope) -> None:
    """Give the node the ``~params`` of its scope, then its own."""
    for name, value, place in [*tag.scope.private, *params.private]:
        try:
            ledger.add_param(params.ns + name.removeprefix("~"), value, place)
        except TextFault as fault:
            tag.fail(fault.reason)


def _refuse_empty(tag: Tag, package: str, type_name: str, name: str) -> None:
    if not package.strip():
        tag.fail("'pkg' is empty", "pkg")
    if not type_name.strip():
        tag.fail("'type' is empty", "type")
    if "/" in name:
        ns, _, base = name.rpartition("/")
        hint = f"; write ns='{ns}' name='{base}'" if ns else f"; write name='{base}'"
        tag.fail(f"node name '{name}' contains '/'{hint}", "name")


def _fates(tag: Tag) -> tuple[bool, bool]:
    """Return respawn and required."""
    respawn, required = tag.flag("respawn"), tag.flag("required")
    if respawn and required:
        tag.fail("'respawn' and 'required' cannot both be true", "required")
    return respawn, required


def _output(tag: Tag) -> Literal["log", "screen"] | None:
    output = tag.get("output")
    if output == "log":
        return "log"
    if output == "screen":
        return "screen"
    if output is not None:
        tag.fail(f"'output' is '{output}'; expected log or screen", "output")
    return None


def _cwd(tag: Tag) -> str:
    cwd = tag.get("cwd")
    if cwd in {None, "ROS_HOME", "ros_home"}:
        return "ROS_HOME"
    if cwd != "node":
        tag.fail(f"'cwd' is '{cwd}'; expected node or ROS_HOME", "cwd")
    return "node"


def _legal(text: str) -> str:
    """Make a base name of a text."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return name if re.match("[A-Za-z]", name) else f"node_{name}"
