"""What ``rosz reconfigure`` prints of descriptions and changes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from rosz.cli.group import print_json, print_lines

if TYPE_CHECKING:
    from rosz.reconfigure import Config, Description, Group, Setting

__all__ = ("flatten", "show_change", "show_description")


def show_description(
    description: Description, config: Config, only: str = "", *, as_json: bool = False
) -> None:
    """Print what there is to set.

    Args:
        description: What there is.
        config: The values that hold.
        only: The setting to print; all when empty.
        as_json: Whether as JSON.

    Raises:
        ParamError: There is no such setting.
    """
    if only:
        setting = description.setting(only)
        if as_json:
            print_json(_row(setting, config))
        else:
            print_lines(_describe(setting, config, ""))
    elif as_json:
        rows = [_row(setting, config) for setting in description.settings.values()]
        print_json({"settings": rows, "groups": _group_rows(description)})
    else:
        print_lines(_describe_group(description.root, config, config["groups"], ""))


def _describe_group(group: Group, config: Config, tree: Config, indent: str) -> Iterator[str]:
    for setting in group.settings:
        yield from _describe(setting, config, indent)
    for inner in group.groups:
        state = tree["groups"][inner.name]
        notes = ", ".join(filter(None, (inner.type, "" if state["state"] else "not shown")))
        yield f"{indent}[{inner.name}]{' ' + notes if notes else ''}"
        yield from _describe_group(inner, config, state, indent + "  ")


def _describe(setting: Setting, config: Config, indent: str) -> Iterator[str]:
    yield f"{indent}{setting.name} ({setting.kind}) = {config[setting.name]!r}"
    if setting.description:
        yield f"{indent}    {setting.description}"
    bounds = ""
    if setting.kind in {"int", "double"}:
        bounds = f", min {setting.min!r}, max {setting.max!r}"
    yield f"{indent}    default {setting.default!r}{bounds}, level {setting.level}"
    choices = setting.choices
    width = max((len(choice.name) for choice in choices), default=0)
    for choice in choices:
        yield f"{indent}    {choice.name:<{width}}  {choice.value!r}  {choice.description}".rstrip()


def _row(setting: Setting, config: Config) -> dict[str, Any]:
    return {
        "name": setting.name,
        "type": setting.kind,
        "value": config[setting.name],
        "default": setting.default,
        "min": setting.min,
        "max": setting.max,
        "level": setting.level,
        "description": setting.description,
        "choices": setting.choices,
    }


def _group_rows(description: Description) -> list[dict[str, Any]]:
    return [
        {
            "name": group.name,
            "id": group.id,
            "parent": parent,
            "type": group.type,
            "settings": [setting.name for setting in group.settings],
        }
        for group, parent in description.groups
    ]


def flatten(config: Config) -> dict[str, Any]:
    """Return the values by name, and the states of groups by ``groups/<name>``."""
    values = {name: value for name, value in config.items() if name != "groups"}
    return values | dict(_states(config["groups"], "groups"))


def _states(tree: Config, place: str) -> Iterator[tuple[str, bool]]:
    for name, inner in tree["groups"].items():
        yield f"{place}/{name}", inner["state"]
        yield from _states(inner, f"{place}/{name}")


def show_change(name: str, old: Any, new: Any, *, as_json: bool = False) -> None:
    """Print a change on one line.

    Args:
        name: What has changed.
        old: Its value before.
        new: Its value now.
        as_json: Whether as JSON.
    """
    if as_json:
        import msgspec

        change = {"name": name, "old": old, "new": new}
        print_lines([msgspec.json.encode(change).decode()])
        return
    from rosz.params.yaml import inline

    print_lines([f"~ {name}: {inline(old)} -> {inline(new)}"])
