"""What files describe, and its messages, are what Debian's dynamic_reconfigure makes of them."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import msgspec
import pytest
from oracle import PYTHON, require

from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMessage
from rosz.msgs.dynamic_reconfigure.msg import GroupState
from rosz.reconfigure.messages import describe, encode_config, pack_description
from rosz.ros1.client.dynamic_reconfigure import get_parameter_names
from rosz.ros1.client.dynamic_reconfigure.cfgfile import load
from rosz.ros1.importer import install, uninstall
from rosz.ros1.modules import submodule

from .cfg_samples import SAMPLES, write_samples

pytestmark = pytest.mark.ros1

encoding = submodule("dynamic_reconfigure.encoding")
CHANGES = {"a": 1, "b": True, "c": "x", "d": 0.5}
NAMES = [*SAMPLES, "Test"]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("sample") / "cfg"
    write_samples(folder)
    return sorted(folder.glob("*.cfg"))


@pytest.fixture(scope="module")
def theirs(files: list[Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("generated")
    require("dynamic_reconfigure", package="python3-dynamic-reconfigure")
    done = subprocess.run(
        [PYTHON, "-W", "ignore", str(Path(__file__).with_name("reconfigure_worker.py"))],
        input=json.dumps(
            {"files": [str(file) for file in files], "folder": str(folder), "changes": CHANGES}
        ),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={"PATH": "/usr/bin:/bin", "HOME": str(folder)},
    )
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


@pytest.fixture(scope="module")
def ours(files: list[Path], theirs: dict[str, Any]) -> dict[str, Any]:
    install()
    try:
        found: dict[str, Any] = {name: load(f"sample.cfg.{name}Config", files) for name in SAMPLES}
    finally:
        uninstall()
    found["Test"] = SimpleNamespace(**theirs["Test"]["module"])
    return found


def _without_places(value: Any) -> Any:
    """Leave out lines: ROS 1 gives that of its own code for what is not in a group."""
    if isinstance(value, dict):
        kept = {k: one for k, one in value.items() if k not in {"srcline", "srcfile"}}
        return {name: _without_places(one) for name, one in kept.items()}
    if isinstance(value, list):
        return [_without_places(one) for one in value]
    return value


def _without_types(config: dict[str, Any]) -> dict[str, Any]:
    """Leave out how groups are shown, which ROS 1 forgets."""

    def bare(group: dict[str, Any]) -> dict[str, Any]:
        inner = {name: bare(one) for name, one in group["groups"].items()}
        return group | {"type": "", "groups": inner}

    return config | {"groups": bare(config["groups"])}


def _plain(value: Any) -> Any:
    """Take messages for what they hold."""
    return json.loads(json.dumps(msgspec.to_builtins(value)))


@pytest.mark.parametrize("name", SAMPLES)
def test_modules(ours: dict[str, Any], theirs: dict[str, Any], name: str) -> None:
    module = ours[name]
    held = {k: v for k, v in vars(module).items() if not k.startswith(("__", "extract_params"))}
    assert _without_places(_plain(held)) == _without_places(theirs[name]["module"])
    assert list(held["config_description"]) == list(theirs[name]["module"]["config_description"])
    assert get_parameter_names(module) == list(theirs[name]["module"]["defaults"])


def test_places_are_those_in_the_file(ours: dict[str, Any], theirs: dict[str, Any]) -> None:
    described = ours["Tutorials"].config_description["parameters"]
    assert [one["srcline"] for one in described] == [8, 9, 10, 11, 17]
    assert {one["srcfile"] for one in described} == {"Tutorials.cfg"}
    enum = described[4]["edit_method"]
    assert (
        enum == theirs["Tutorials"]["module"]["config_description"]["parameters"][4]["edit_method"]
    )


@pytest.mark.parametrize("name", NAMES)
def test_encoding(ours: dict[str, Any], theirs: dict[str, Any], name: str) -> None:
    module, expected = ours[name], theirs[name]
    description = encoding.encode_description(module)
    assert _plain(description) == expected["encode_description"]
    decoded = encoding.decode_description(description)
    assert _plain(decoded) == expected["decode_description"]
    assert _plain(encoding.extract_params(decoded)) == expected["extract_decoded"]
    assert _plain(encoding.get_tree(description)) == expected["get_tree"]
    config = encoding.Config(module.defaults)
    config["groups"] = encoding.get_tree(description)
    first = encoding.initial_config(encoding.encode_config(config), module.config_description)
    assert _plain(first) == expected["initial_config"]
    assert list(first) == expected["order"]
    message = encoding.encode_config(first)
    assert _plain(message) == expected["encode_config"]
    assert _plain(encoding.decode_config(message, decoded)) == expected["decode_config"]
    assert repr(encoding.decode_config(message, decoded)) == expected["printed"]
    assert _plain(encoding.decode_config(message)) == expected["decode_flat"]
    assert _plain(encoding.encode_config(CHANGES)) == expected["changes"]


@pytest.mark.parametrize("name", NAMES)
def test_what_the_library_below_sends(
    ours: dict[str, Any], theirs: dict[str, Any], name: str
) -> None:
    module, expected = ours[name], theirs[name]
    description = describe(module.config_description)
    assert _plain(pack_description(description)) == expected["encode_description"]
    config = description.config(description.defaults(), description.states())
    assert _without_types(_plain(config)) == _without_types(expected["initial_config"])
    assert _plain(encode_config(config)) == expected["encode_config"]


def test_the_state_of_any_group_is_found() -> None:
    """ROS 1 finds that of the first one among its siblings only."""

    def group(name: str, number: int, state: bool, *inner: dict[str, Any]) -> dict[str, Any]:
        given = {"name": name, "id": number, "state": state, "groups": list(inner)}
        return given | {"type": "", "parent": 0, "parameters": []}

    root = group("Default", 0, True, group("A", 1, True), group("B", 2, False))
    shown = ConfigMessage(groups=[GroupState(name, True, n, 0) for n, name in enumerate("DAB")])
    first = encoding.initial_config(shown, root)
    assert [one.state for one in first.groups.groups.values()] == [True, False]
    assert [state.state for state in encode_config(describe(root).config({}, {})).groups] == [
        True, True, False,
    ]  # fmt: skip


def test_a_level_of_all_bits() -> None:
    given = {"name": "a", "type": "int", "level": -1, "description": "", "edit_method": ""}
    group = {"name": "G", "type": "", "parent": 0, "id": 0, "parameters": [given], "groups": []}
    (message,) = encoding.encode_groups(None, group)
    assert message.to_cdr()
    assert message.parameters[0].level == 0xFFFFFFFF


def test_groups_as_a_list() -> None:
    groups = [{"name": "G", "state": False, "id": 1, "parent": 0}]
    message = encoding.encode_config({"a": 1, "groups": groups}, flat=False)
    assert _plain(message.groups) == [{"name": "G", "state": False, "id": 1, "parent": 0}]


def test_a_module_has_what_catkin_gives_it(ours: dict[str, Any]) -> None:
    module = ours["Enums"]
    assert isinstance(module, ModuleType)
    assert module.__name__ == "sample.cfg.EnumsConfig"
    assert (module.__file__ or "").endswith("Enums.cfg")
    assert (module.Enums_Fast, module.Enums_2xHalf, module.Enums_Alone) == ("fast", 1.0, True)
    assert module.inf == float("inf")
    assert module.extract_params(module.config_description)[0]["name"] == "mode"
