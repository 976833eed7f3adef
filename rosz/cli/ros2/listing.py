"""Lists and descriptions of topics, services, actions and nodes."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable, Mapping, Sequence

from rosz.cli.console import print_error, print_lines
from rosz.cli.ros2.graph import is_hidden, read_view, visible_nodes
from rosz.graph import View
from rosz.qos import DEFAULT, FOREVER
from rosz.wire import Kind, Token, format_token, gid

_ENDS = {
    Kind.PUBLISHER: ("Published", "publisher"),
    Kind.SUBSCRIPTION: ("Subscribed", "subscriber"),
}
_ACTION = "/_action/send_goal"
_GOAL = "_SendGoal"


def names_of(tokens: Iterable[Token], *kinds: Kind, hidden: bool = True) -> dict[str, list[str]]:
    """Return the names of the entities of some kinds, each with its types, sorted.

    Args:
        tokens: The entities.
        kinds: The kinds.
        hidden: Whether to return hidden names as well.
    """
    ends = {(token.name, token.type_name) for token in tokens if token.kind in kinds}
    names: dict[str, list[str]] = {}
    for name, type_name in sorted(ends):
        if hidden or not is_hidden(name):
            names.setdefault(name, []).append(type_name)
    return names


def _actions(services: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    return {
        name.removesuffix(_ACTION): [each.removesuffix(_GOAL) for each in types]
        for name, types in services.items()
        if name.endswith(_ACTION)
    }


def _names(view: View, given: Namespace) -> dict[str, list[str]]:
    """Return the topics, services or actions, as the command says."""
    if given.group == "action":
        return _actions(names_of(view.tokens, Kind.SERVICE, Kind.CLIENT))
    kinds = _ENDS if given.group == "topic" else (Kind.SERVICE,)
    hidden = getattr(given, "hidden", False) or getattr(given, f"include_hidden_{given.group}s")
    return names_of(view.tokens, *kinds, hidden=hidden)


def list_names(given: Namespace) -> None:
    """List topics, services or actions."""
    view = read_view()
    names = _names(view, given)
    if given.count:
        print_lines([str(len(names))])
        return
    if not getattr(given, "verbose", False):
        shown = given.show_types
        print_lines(f"{each} [{', '.join(of)}]" if shown else each for each, of in names.items())
        return
    for kind, (title, end) in _ENDS.items():
        lines = [f"{title} topics:"]
        for name, types in names.items():
            number = len(view.entities(kind, name=name))
            if number:
                many = "s" if number > 1 else ""
                lines.append(f" * {name} [{', '.join(types)}] {number} {end}{many}")
        print_lines([*lines, ""])


def print_types(given: Namespace) -> int:
    """Print the types of a topic, service or action."""
    names = _names(read_view(), given)
    print_lines(names.get(given.name, ()))
    return int(given.name not in names)


def find_names(given: Namespace) -> None:
    """List the topics, services or actions of a type."""
    names = [name for name, of in _names(read_view(), given).items() if given.type in of]
    print_lines([str(len(names))] if given.count else names)


def topic_info(given: Namespace) -> str | None:
    """Describe a topic."""
    view = read_view()
    types = names_of(view.tokens, *_ENDS).get(given.name)
    if types is None:
        return f"Unknown topic '{given.name}'"
    gap = [""] if given.verbose else []
    lines = [f"Type: {types[0] if len(types) == 1 else types}", *gap]
    for title, kind in (("Publisher", Kind.PUBLISHER), ("Subscription", Kind.SUBSCRIPTION)):
        ends = view.entities(kind, name=given.name)
        lines += [f"{title} count: {len(ends)}", *gap]
        for token in ends if given.verbose else ():
            lines += [*_describe_end(token, title.upper()), ""]
    print_lines(lines)
    return None


def _describe_end(token: Token, kind: str) -> list[str]:
    qos = token.qos or DEFAULT
    depth = f" ({qos.depth})" if qos.history == "keep_last" else ""
    return [
        f"Node name: {token.node}",
        f"Node namespace: {token.namespace}",
        f"Topic type: {token.type_name}",
        f"Topic type hash: {token.type_hash or _hash(token.type_name)}",
        f"Endpoint type: {kind}",
        f"GID: {'.'.join(f'{octet:02x}' for octet in gid(format_token(token)))}",
        "QoS profile:",
        f"  Reliability: {qos.reliability.upper()}",
        f"  History (Depth): {qos.history.upper()}{depth}",
        f"  Durability: {qos.durability.upper()}",
        f"  Lifespan: {_span(qos.lifespan)}",
        f"  Deadline: {_span(qos.deadline)}",
        f"  Liveliness: {qos.liveliness.upper()}",
        f"  Liveliness lease duration: {_span(qos.lease)}",
    ]


def _hash(type_name: str) -> str:
    from rosz.typestore import TypeStore

    return TypeStore().message(type_name)._type_hash


def _span(nanoseconds: int) -> str:
    return "Infinite" if nanoseconds in {0, FOREVER} else f"{nanoseconds} nanoseconds"


def service_info(given: Namespace) -> str | None:
    """Describe a service."""
    view = read_view()
    types = _names(view, given).get(given.name)
    if types is None:
        return f"Unknown service '{given.name}'"
    print_lines(
        [
            f"Type: {types[0] if len(types) == 1 else types}",
            f"Clients count: {len(view.clients(given.name))}",
            f"Services count: {len(view.servers(given.name))}",
        ]
    )
    return None


def action_info(given: Namespace) -> None:
    """Describe an action."""
    view, lines = read_view(), [f"Action: {given.name}"]
    goals = f"/{given.name.strip('/')}{_ACTION}"
    for title, tokens in (("clients", view.clients(goals)), ("servers", view.servers(goals))):
        lines.append(f"Action {title}: {len(tokens)}")
        for token in () if given.count else tokens:
            shown = f" [{token.type_name.removesuffix(_GOAL)}]" if given.show_types else ""
            lines.append(f"    {token.node_name}{shown}")
    print_lines(lines)


def list_nodes(given: Namespace) -> None:
    """List nodes."""
    names = visible_nodes(read_view(), hidden=given.hidden)
    if len(set(names)) < len(names) and not given.count:
        print_error(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, which"
            " can have unintended side effects."
        )
    print_lines([str(len(names))] if given.count else names)


def node_info(given: Namespace) -> str | None:
    """Describe a node."""
    view = read_view()
    number = visible_nodes(view, hidden=given.hidden).count(given.node)
    if not number:
        return f"Unable to find node '{given.node}'"
    if number > 1:
        print_error(
            f'There are {number} nodes in the graph with the exact name "{given.node}". You are'
            " seeing information about only one of them."
        )
    first = next(token for token in view.tokens if token.node_name == given.node)
    own = [t for t in view.tokens if (t.zid, t.node_id) == (first.zid, first.node_id)]
    servers, clients = names_of(own, Kind.SERVICE), names_of(own, Kind.CLIENT)
    sections = {
        "Subscribers": names_of(own, Kind.SUBSCRIPTION),
        "Publishers": names_of(own, Kind.PUBLISHER),
        "Service Servers": servers,
        "Service Clients": clients,
        "Action Servers": _actions(servers),
        "Action Clients": _actions(clients),
    }
    lines = [given.node]
    for title, names in sections.items():
        rows = [
            f"    {name}: {', '.join(types)}"
            for name, types in names.items()
            if given.hidden or not is_hidden(name)
        ]
        lines += [f"  {title}:", *(rows or [""])]
    print_lines(lines)
    return None
