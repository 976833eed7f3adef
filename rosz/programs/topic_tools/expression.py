"""The programs ``transform`` and ``relay_field``: messages made of parts of other messages.

Both evaluate Python expressions of the command line; ``m`` in them is the message, or its field.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

import yaml

from rosz.errors import RoszError
from rosz.introspect import Target, find_target, resolve_field, topic_types, wait_for_target
from rosz.message import fill_message_args
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.node import Node, serve_loggers
from rosz.remap import parse


def transform() -> None:
    """Publish the value of an expression for each message."""
    parser = _parser("For each message or field 'm', publish the value of a Python expression.")
    parser.add_argument("expression", nargs="?", default="m", help="expression with 'm' in it")
    parser.add_argument(
        "-i", "--import", dest="modules", nargs="+", default=["numpy"], help="modules to import"
    )
    parser.add_argument("--latch", action="store_true", help="latch the last message")
    options = parser.parse_args(list(parse(sys.argv[1:]).rest))
    modules = _import_all(options.modules)
    try:
        code = compile(options.expression.strip(), "<expression>", "eval")
    except SyntaxError as error:
        parser.error(f"'{options.expression}' is not a Python expression: {error.msg}")

    def make(node: Node, message_type: type[Any], part: Any) -> Any:  # noqa: ARG001
        result = eval(code, dict(modules), {"m": part})  # noqa: S307  # the purpose of the program
        return message_type(*(result if isinstance(result, list | tuple) else [result]))

    _run("transform", options, make, latch=options.latch)


def relay_field() -> None:
    """Publish a message of expressions for each message."""
    parser = _parser("For each message or field 'm', publish a message of expressions.")
    parser.add_argument("expression", help="fields in YAML, such as 'frame_id: m.data'")
    options = parser.parse_args(list(parse(sys.argv[1:]).rest))
    try:
        fields = yaml.safe_load(options.expression)
    except yaml.YAMLError as error:
        parser.error(f"the fields are not YAML: {error}")
    if not isinstance(fields, dict):
        parser.error(f"expected fields in YAML, such as 'data: m.x', got '{options.expression}'")

    def make(node: Node, message_type: type[Any], part: Any) -> Any:
        now = Time.from_nsec(node.now())
        message = message_type()
        fill_message_args(message, [_evaluate(fields, part)], {"now": now})
        return message

    _run("relay_field", options, make)


def _parser(description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("input", help="topic, or field of a topic")
    parser.add_argument("output_topic", help="topic to publish")
    parser.add_argument("output_type", help="type of that topic")
    parser.add_argument(
        "--wait-for-start", action="store_true", help="wait until the input is published"
    )
    parser.add_argument("--tcpnodelay", action="store_true", help="ignored: there is no TCPROS")
    return parser


def _import_all(modules: list[str]) -> dict[str, Any]:
    """Return modules and their top packages by name; report a module that is missing."""
    imported: dict[str, Any] = {}
    for name in modules:
        try:
            imported[name] = import_module(name)
        except ImportError as error:
            sys.stderr.write(f"transform: cannot import module '{name}': {error}\n")
    for name in [name for name in imported if "." in name]:
        imported[name.partition(".")[0]] = import_module(name.partition(".")[0])
    return imported


def _evaluate(fields: Any, part: Any) -> Any:
    """Return fields with their texts evaluated; a text that is not an expression stays as it is."""
    if isinstance(fields, dict):
        return {name: _evaluate(value, part) for name, value in fields.items()}
    if not isinstance(fields, str):
        return fields
    try:
        value = eval(fields, {}, {"m": part})  # noqa: S307  # the purpose of the program
    except (NameError, SyntaxError):
        return fields
    # "map" is the name of a frame, not the builtin function.
    return fields if callable(value) else value


def _run(
    name: str,
    options: argparse.Namespace,
    make: Callable[[Node, type[Any], Any], Any],
    *,
    latch: bool = False,
) -> None:
    """Publish the result of a function for each message, or field, of the input."""
    with Node(name, anonymous=True) as node:
        serve_loggers(node)
        try:
            message_type = node.context.types.message(options.output_type)
            target = _find(node, options.input, wait=options.wait_for_start)
        except RoszError as error:
            if node.is_shutdown:
                return
            sys.exit(f"{name}: {error}")
        output = node.publisher(options.output_topic, message_type, queue_size=1, latch=latch)

        def pass_on(message: Any) -> None:
            output.publish(make(node, message_type, target.path.read(message)))

        node.subscription(target.topic, target.type_name, pass_on)
        node.spin()


def _find(node: Node, name: str, *, wait: bool) -> Target:
    """Return the topic that a text names, and the field of its messages."""
    context, name = node.context, resolve_field(name, node.resolve)
    if wait:
        text = f"WARNING: topic [{name}] does not appear to be published yet\n"
        return wait_for_target(node, name, lambda _: sys.stderr.write(text))[0]
    return context.graph.find(
        lambda view: find_target(name, topic_types(view), context.types.message)
    )
