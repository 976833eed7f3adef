"""The tags that describe processes: ``<node>``, ``<test>``, ``<executable>`` and ``<machine>``.

``wait_for``, an addition to roslaunch, names things that must exist before a node starts:
``wait_for="topic /scan"`` waits for one thing; a comma adds another, and ``|`` separates
alternatives, as in ``topic /scan, service /reset | param /ready``. The kinds are topic, service,
param and node; names are resolved as the node would resolve them. ``wait_timeout`` is in seconds,
30 by default. On a group, both concern every node in it, and each node may add its own.

Every function that reads a tag raises `TagError` if the tag, or one inside it, is wrong.
"""

from __future__ import annotations

import math
import re
from typing import Literal, get_args

from msgspec.structs import replace

from rosz import names
from rosz.errors import InvalidName, near_miss
from rosz.launch.plan.document import TagError, misplaced
from rosz.launch.plan.model import Condition, MachinePlan, NodePlan, PlanBuilder, TestPlan, Wait
from rosz.launch.plan.param import read_param, read_rosparam
from rosz.launch.plan.scope import Scope, join
from rosz.launch.plan.tag import Tag

_DEFAULT_TIME_LIMIT = 60.0
_DEFAULT_WAIT = 30.0
_DEFAULT_CONNECT = 10.0
_DEFAULT_PORT = 22
_MAX_PORT = 65535
_OLD_MACHINE = ("ros-root", "ros-package-path", "ros-ip", "ros-hostname")
_MACHINE_DEFAULTS = ("true", "false", "never")

_Kind = Literal["topic", "service", "param", "node"]
_KINDS: dict[str, _Kind] = {kind: kind for kind in get_args(_Kind)}


def read_namespace(tag: Tag) -> str | None:
    """Return the ``ns`` of a tag, or None if it is absent."""
    ns = tag.alias("ns", "namespace")
    if ns is not None and not ns:
        tag.fail("'ns' is empty; leave it out, or write '/' for the root", "ns")
    return ns


def read_container(tag: Tag, scope: Scope) -> None:
    """Read ``container`` and ``by_reference`` of a ``<group>`` into its scope."""
    name = tag.get("container")
    if name is not None:
        try:
            scope.container = names.canonical(join(scope.ns, names.check(name)))
        except InvalidName as error:
            tag.fail(f"'container': {error}", "container")
        if not name or name.endswith("/") or names.is_private(name):
            tag.fail(f"'container' is '{name}'; expected a name such as 'vision'", "container")
        scope.by_reference = False
    if "by_reference" in tag.element.attributes:
        if name is None:
            tag.fail("'by_reference' needs 'container'", "by_reference")
        scope.by_reference = tag.flag("by_reference")


def read_node(tag: Tag, builder: PlanBuilder) -> None:
    """Read ``<node>``.

    With ROS 2's ``exec`` in place of ``type`` the name may be left out. It is then the name of the
    executable; ROS 2 leaves it to the program.
    """
    tag.check()
    if "name" in tag.element.attributes or "type" in tag.element.attributes:
        name = tag.require("name")
    else:
        name = _valid_name(tag.require("type", "exec").partition(".")[0])
    node = _read_node(tag, builder, name)
    with tag.refusing("name"):
        builder.add_node(node)


def read_test(tag: Tag, builder: PlanBuilder) -> None:
    """Read ``<test>``."""
    for attribute in ("respawn", "respawn_delay", "output"):
        if attribute in tag.element.attributes:
            tag.fail(f"a <test> cannot have '{attribute}'", attribute)
    tag.check()
    test_name = tag.require("test-name")
    name = tag.get("name") or test_name
    limit = _DEFAULT_TIME_LIMIT
    if tag.get("time-limit"):
        limit = _positive(tag, "time-limit", limit)
    retry = tag.whole("retry", 0, -math.inf) or 0
    # A test run ends with each test, so 'required' has no meaning there.
    node = replace(_read_node(tag, builder, name), required=False)
    builder.tests.append(TestPlan(node, test_name, limit, retry))


def read_executable(tag: Tag, builder: PlanBuilder) -> None:
    """Read ROS 2's ``<executable>``, a program that is not a ROS node.

    ``cmd`` is split as a shell does, but not run by one; ``shell`` is not supported.
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
    base = builder.unused_name(scope.ns, _valid_name(command[0].rpartition("/")[2]))
    node = NodePlan(
        package="",
        type="",
        command=command,
        name=name or base,
        named=bool(name),
        namespace=names.canonical(scope.ns),
        place=tag.place,
        args=tag.words("args"),
        cwd=tag.get("cwd") or "",
        env=tuple(scope.env),
        wait_for=(*scope.waits, *read_wait(tag, scope.ns, name or base)),
    )
    node = _with_start(tag, node)
    with tag.refusing("name"):
        builder.add_node(node)


def _with_start(tag: Tag, node: NodePlan) -> NodePlan:
    """Return a node with the attributes about its start and its end."""
    respawn, required = tag.flag("respawn"), tag.flag("required")
    if respawn and required:
        tag.fail("'respawn' and 'required' cannot both be true", "required")
    output = tag.get("output")
    if output not in {None, "log", "screen"}:
        tag.fail(f"'output' is '{output}'; expected log or screen", "output")
    return replace(
        node,
        launch_prefix=tag.words("launch-prefix"),
        respawn=respawn,
        respawn_delay=tag.number("respawn_delay", 0.0),
        respawn_max=tag.whole("respawn_max", None, 0),
        required=required,
        output="screen" if output == "screen" else "log",
        spawn_delay=tag.number("spawn_delay", 0.0, 0.0),
    )


def _read_node(tag: Tag, builder: PlanBuilder, name: str) -> NodePlan:
    if not names.is_valid(name):
        tag.warn(f"'{name}' is not a valid name; other tools will not accept it", "name")
    own, params = _open_scopes(tag, builder, name)
    package = tag.require("pkg")
    type_name = tag.alias("type", "exec")
    if type_name is None:
        type_name = tag.require("type")
    _check_words(tag, package, type_name, name)
    node = _with_start(
        tag,
        NodePlan(
            package=package,
            type=type_name,
            name=name or builder.context.anonymous(_valid_name(type_name)),
            named=bool(name),
            namespace=names.canonical(own.ns),
            place=tag.place,
            machine=tag.get("machine") or builder.default_machine,
            args=tag.split("args", tag.again("args")),
            cwd=_read_cwd(tag),
            wait_for=(*tag.scope.waits, *read_wait(tag, own.ns, name)),
            container=tag.scope.container,
            by_reference=tag.scope.by_reference,
        ),
    )
    remaps, env = tag.scope.child(), tag.scope.child()
    _read_children(tag, builder, params, remaps, env)
    _add_private(tag, builder, params)
    return replace(node, remaps=tuple(remaps.remaps), env=tuple(env.env))


def _open_scopes(tag: Tag, builder: PlanBuilder, name: str) -> tuple[Scope, Scope]:
    ns = read_namespace(tag)
    if name.startswith("~"):
        tag.fail(f"node name '{name}' starts with '~', as only names within a node do", "name")
    with tag.refusing("ns" if ns else "name"):
        own = tag.scope.child(ns)
        params = own.child(name)
    params.private = {}
    if tag.get("clear_params") and tag.flag("clear_params"):
        if not name:
            tag.fail("'clear_params' needs a node with a name", "clear_params")
        builder.clear(join(own.ns, name))
    return own, params


def _read_children(
    tag: Tag, builder: PlanBuilder, params: Scope, remaps: Scope, env: Scope
) -> None:
    scopes = {"remap": tag.scope, "param": params, "rosparam": params, "env": env}
    for element in tag.element.children:
        name = element.tag.lower()
        inner = tag.inside(element, scopes.get(name, tag.scope))
        try:
            if name not in scopes:
                inner.warn(misplaced(element.tag, tag.name))
            elif not inner.wanted():
                continue
            elif name == "remap":
                inner.remap(remaps)
            elif name == "env":
                inner.env(env)
            elif name == "param":
                read_param(inner, builder, in_node=True)
            else:
                read_rosparam(inner, builder)
        except TagError as error:
            tag.refuse(error)


def _add_private(tag: Tag, builder: PlanBuilder, params: Scope) -> None:
    """Add the ``~params`` of the scope around a node, then the node's own."""
    for name, (value, place) in [*tag.scope.private.items(), *params.private.items()]:
        with tag.refusing():
            builder.add_param(params.ns + name.removeprefix("~"), value, place)


def _check_words(tag: Tag, package: str, type_name: str, name: str) -> None:
    if not package.strip():
        tag.fail("'pkg' is empty", "pkg")
    if not type_name.strip():
        tag.fail("'type' is empty", "type")
    if "/" in name:
        ns, _, base = name.rpartition("/")
        hint = f"; write ns='{ns}' name='{base}'" if ns else f"; write name='{base}'"
        tag.fail(f"node name '{name}' contains '/'{hint}", "name")


def _read_cwd(tag: Tag) -> str:
    cwd = tag.get("cwd")
    if cwd is None:
        return ""
    if cwd in {"ROS_HOME", "ros_home"}:
        return "ROS_HOME"
    if cwd != "node":
        tag.fail(f"'cwd' is '{cwd}'; expected node or ROS_HOME", "cwd")
    return "node"


def _valid_name(text: str) -> str:
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return name if re.match("[A-Za-z]", name) else f"node_{name}"


def _positive(tag: Tag, attribute: str, default: float) -> float:
    seconds = tag.number(attribute, default)
    if seconds <= 0:
        tag.fail(f"'{attribute}' is '{seconds:g}'; expected more than 0 seconds", attribute)
    return seconds


def read_wait(tag: Tag, ns: str, node: str = "") -> tuple[Wait, ...]:
    """Read ``wait_for`` and ``wait_timeout``; a group has no node, and so no private names."""
    text = tag.get("wait_for")
    if text is None:
        if "wait_timeout" in tag.element.attributes:
            tag.warn("'wait_timeout' does nothing without 'wait_for'", "wait_timeout")
        return ()
    timeout = tag.number("wait_timeout", _DEFAULT_WAIT, 0.0)
    return tuple(
        Wait(
            tuple(_read_condition(tag, part.split(), ns, node) for part in group.split("|")),
            timeout,
            tag.place,
        )
        for group in text.split(",")
    )


def _read_condition(tag: Tag, words: list[str], ns: str, node: str) -> Condition:
    kind, name = words if len(words) == 2 else ("", "")  # noqa: PLR2004  # a kind and a name
    if not kind:
        written = " ".join(words)
        expected = "expected a kind and a name, as in 'topic /scan'"
        tag.fail(f"'wait_for' has '{written}'; {expected}", "wait_for")
    if kind not in _KINDS:
        hint = near_miss(kind, _KINDS) or f"; there are {', '.join(_KINDS)}"
        tag.fail(f"'wait_for' has no kind '{kind}'{hint}", "wait_for")
    if names.is_private(name) and not node:
        tag.fail(f"'wait_for' has '{name}', and a group has no private names", "wait_for")
    try:
        return Condition(_KINDS[kind], names.resolve(name, f"{ns}{node or '_'}"))
    except InvalidName as error:
        tag.fail(f"'wait_for': {error}", "wait_for")


def read_machine(tag: Tag, builder: PlanBuilder) -> None:
    """Read ``<machine>``."""
    for old in _OLD_MACHINE:
        if tag.get(old):
            tag.fail(f"'{old}' is no longer supported; let 'env-loader' set the environment", old)
    tag.check()
    name, address = tag.require("name"), tag.require("address")
    default = (tag.get("default") or "false").lower()
    if default not in _MACHINE_DEFAULTS:
        tag.fail(f"'default' is '{default}'; expected {', '.join(_MACHINE_DEFAULTS)}", "default")
    for element in tag.element.children:
        inner = tag.inside(element, tag.scope)
        if element.tag == "env":
            inner.fail("<machine> no longer takes <env>; let 'env-loader' set the environment")
        inner.warn(misplaced(element.tag, "machine"))
    port = tag.whole("ssh-port", _DEFAULT_PORT, 1) or _DEFAULT_PORT
    if port > _MAX_PORT:
        tag.fail(f"'ssh-port' is '{port}'; expected {_MAX_PORT} or less", "ssh-port")
    machine = MachinePlan(
        name=name,
        address=address,
        env_loader=tag.get("env-loader") or "",
        ssh_port=port,
        user=tag.get("user") or "",
        password=tag.get("password") or "",
        timeout=_positive(tag, "timeout", _DEFAULT_CONNECT),
        assignable=default != "never",
        place=tag.place,
    )
    with tag.refusing("name"):
        builder.add_machine(machine)
    if default == "true":
        builder.default_machine = name
