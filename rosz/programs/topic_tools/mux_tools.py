"""The programs ``mux_select``, ``mux_add`` … and ``demux_select`` …: calls of a mux's services."""

from __future__ import annotations

import sys
from pathlib import Path

from rosz.errors import RoszError
from rosz.message import Service
from rosz.msgs.topic_tools import srv
from rosz.node import Node
from rosz.programs.topic_tools.passing import words

__all__ = ("main",)

_FOREVER = 1e9
_VERBS = {
    "add": ("TOPIC", 'Adding "{topic}" to {kind} "{name}"'),
    "delete": ("TOPIC", 'Deleting "{topic}" from {kind} "{name}"'),
    "list": ("", 'Listing topics from {kind} "{name}"'),
    "select": ("TOPIC", 'Selecting "{topic}" at {kind} "{name}"'),
}


def main() -> None:
    """Call the service that the name of the program tells."""
    program = Path(sys.argv[0]).name
    kind, _, verb = program.partition("_")
    argument, doing = _VERBS[verb]
    given = words()
    if len(given) != 1 + bool(argument):
        sys.exit(f"usage: {program} {kind.upper()}_NAME {argument}".rstrip())
    name, *topic = given
    with Node(program, anonymous=True) as node:
        service_type: type[Service] = getattr(srv, f"{kind.title()}{verb.title()}")
        client = node.client(f"{name}/{verb}", service_type)
        _say(f'Waiting for service "{name}/{verb}"')
        try:
            client.wait_for_service(_FOREVER)
            _say(doing.format(topic="".join(topic), kind=kind, name=name))
            response = client(*topic)
        except RoszError as error:
            if node.is_shutdown:
                return
            sys.exit(f"{program}: {error}")
        if verb == "list":
            _say(str(list(response.topics)))


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()
