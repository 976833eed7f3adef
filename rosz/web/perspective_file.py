"""The files that rqt is started with (``--perspective-file``): its plugins, and their topics."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

from rosz.errors import UsageError

__all__ = ("read_perspective",)

_TOPICS = ("topic", "topics")
"""Keys under which plugins such as rqt_image_view and rqt_plot keep what they show."""


def read_perspective(path: Path) -> dict[str, list[str]]:
    """Return the plugins that a perspective shows, such as ``rqt_plot/Plot``, with their topics.

    Args:
        path: The file.

    Raises:
        UsageError: It cannot be read, or is not a perspective of rqt.
    """
    try:
        content = json.loads(path.read_text())
        manager = content["groups"]["pluginmanager"]
        running = _literal(manager["keys"]["running-plugins"])
        return {
            str(plugin): [
                topic for number in numbers for topic in _topics(manager, str(plugin), number)
            ]
            for plugin, numbers in running.items()
        }
    except OSError as error:
        raise UsageError(f"cannot read '{path}': {error}") from error
    except (ValueError, SyntaxError, LookupError, TypeError, AttributeError) as error:
        raise UsageError(
            f"'{path}' is not a perspective of rqt: expected JSON with 'running-plugins'"
        ) from error


def _literal(entry: dict[str, Any]) -> Any:
    """Return the value of an entry, which is written as Python writes it."""
    return ast.literal_eval(entry["repr"])


def _topics(manager: dict[str, Any], plugin: str, number: int) -> list[str]:
    """Return the topics that one instance of a plugin shows; of what is not known, none."""
    name = f"plugin__{plugin.replace('/', '__')}__{number}"
    keys = manager.get("groups", {}).get(name, {}).get("groups", {}).get("plugin", {})
    found: list[str] = []
    for key in _TOPICS:
        entry = keys.get("keys", {}).get(key)
        if entry is not None:
            value = _literal(entry)
            found += [value] if isinstance(value, str) else value
    return [one for one in map(str, found) if one.strip("/ ")]
