"""Settings without a network: their rules, their messages, their files."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import pytest

from rosz.errors import DecodeError, ParamError, YamlError
from rosz.msgs.dynamic_reconfigure.msg import ConfigDescription
from rosz.msgs.dynamic_reconfigure.msg import Group as GroupMessage
from rosz.reconfigure import Choice, Config, Description, Group, Setting, dump, enumeration, load
from rosz.reconfigure.messages import pack_description, unpack_description

from .robots import ROBOT, SIZES


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"name": "1st", "default": 1}, "'1st' is not a name of a setting"),
        ({"name": "a-b", "default": 1}, "'a-b' is not a name of a setting"),
        ({"name": "a", "default": None}, "None is not a value of a setting"),
        ({"name": "a", "default": 1, "max": 2.5}, "'a' has type int, but max is 2.5"),
        ({"name": "a", "default": "x", "kind": "int"}, "'a' has type int, but default is 'x'"),
        ({"name": "a", "default": True, "kind": "int"}, "'a' has type int, but default is True"),
        ({"name": "a", "default": "x", "min": "a"}, "'a' is of type 'str', which has no min and"),
        ({"name": "a", "default": 1 << 31}, "'a' cannot be 2147483648: expected -2147483648 to"),
    ],
)
def test_a_setting_that_makes_no_sense(arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(ParamError) as caught:
        Setting(**arguments)
    assert str(caught.value).startswith(text)


def test_bounds_are_those_of_the_type() -> None:
    setting = Setting("gain", 1, kind="double")
    assert (setting.default, setting.min, setting.max) == (1.0, float("-inf"), float("inf"))
    assert type(setting.default) is float


def test_names_differ() -> None:
    with pytest.raises(ParamError, match="two settings have the name 'a'"):
        Description((Setting("a", 1),), (Group("G", (Setting("a", 2),)),))


def test_choices() -> None:
    assert Setting("size", 0, edit_method=SIZES).choices == (
        Choice("Small", 0, "A small one"),
        Choice("Large", 2, "A large one"),
    )
    speed = Setting("speed", "slow", edit_method=enumeration([Choice("Fast", "fast")]))
    assert speed.convert("FAST") == "fast"
    assert speed.convert("other") == "other"


@pytest.mark.parametrize(
    "text", ["colour", "{'enum': 1}", "{'enum': [{}]}", "__import__('os')", "(" * 500, "{'a': 1}"]
)
def test_an_edit_method_of_the_network_is_never_run(text: str) -> None:
    setting = Setting("size", 0, edit_method=text)
    assert setting.choices == ()
    assert setting.convert("7") == 7


def test_numpy_scalars() -> None:
    numpy = pytest.importorskip("numpy")
    converted = Setting("gain", 0.0).convert(numpy.float32(0.5))
    assert (converted, type(converted)) == (0.5, float)
    assert Setting("on", False).convert(numpy.bool_(True)) is True


def test_levels_are_ored() -> None:
    old = ROBOT.defaults()
    assert ROBOT.level(old, old) == 0
    assert ROBOT.level(old, old | {"gain": 1.0, "label": "", "taps": 3}) == 5


def test_a_description_survives_its_message() -> None:
    message = pack_description(ROBOT)
    again = unpack_description(ConfigDescription.from_cdr(message.to_cdr()))
    assert again.settings == ROBOT.settings
    assert pack_description(again) == message


def _damaged(change: str) -> ConfigDescription:
    message = pack_description(ROBOT)
    match change:
        case "no root":
            message.groups[0].id = 9
        case "two roots":
            message.groups.append(GroupMessage("Default"))
        case "no default":
            message.dflt.doubles.clear()
        case "type":
            message.groups[0].parameters[0].type = "complex"
        case "default":
            message.groups[0].parameters[0].type = "int"
    return message


@pytest.mark.parametrize("change", ["no root", "two roots", "no default", "type", "default"])
def test_a_description_that_contradicts_itself(change: str) -> None:
    with pytest.raises(DecodeError, match="dynamic_reconfigure/ConfigDescription: it contradicts"):
        unpack_description(_damaged(change))


def test_config_is_a_dictionary_with_attributes() -> None:
    config = ROBOT.config(ROBOT.defaults(), {})
    config.gain = 3.0
    del config.label
    assert config["gain"] == 3.0
    assert not hasattr(config, "label")
    with pytest.raises(AttributeError, match="this configuration has no 'nothing'"):
        _ = config.nothing
    with pytest.raises(AttributeError):
        del config.nothing
    for other in (config.copy(), copy.deepcopy(config), pickle.loads(pickle.dumps(config))):
        assert other == config
        assert type(other) is type(other.groups.groups.Filter) is Config
    assert copy.deepcopy(config).groups is not config.groups
    assert repr(Config(a=1)) == "{'a': 1}"


def test_files() -> None:
    config = ROBOT.config(ROBOT.defaults(), {1: True})
    text = dump(config)
    assert text.startswith("cutoff: 2.5\nenabled: true\ngain: 0.5\ngroups:\n  Deep: true\n")
    assert load(text) == ROBOT.defaults() | {
        "groups": {"Filter": True, "Deep": True, "Other": True}
    }
    assert load("a: 1\nb: 2\n---\nb: 3\n") == {"a": 1, "b": 3}


def test_files_of_ros1() -> None:
    text = """\
!!python/object/new:dynamic_reconfigure.encoding.Config
dictitems:
  gain: 0.5
  dictitems: 3
  groups: !!python/object/new:dynamic_reconfigure.encoding.Config
    dictitems:
      groups: !!python/object/new:dynamic_reconfigure.encoding.Config
        dictitems:
          Filter: !!python/object/new:dynamic_reconfigure.encoding.Config
            dictitems:
              groups: !!python/object/new:dynamic_reconfigure.encoding.Config
                state: []
              id: 1
              state: false
            state: []
        state: []
      id: 0
      state: true
    state: []
state: []
"""
    assert load(text) == {"gain": 0.5, "dictitems": 3, "groups": {"Filter": False}}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("- 1", "expected a dictionary of names to values"),
        ("a: [", "saved.yaml:2:1:"),
        ("a: !!python/object/apply:os.system [ls]", "means nothing for a parameter"),
    ],
)
def test_a_file_that_is_none(text: str, reason: str) -> None:
    with pytest.raises(YamlError) as caught:
        load(text, "saved.yaml")
    assert reason in str(caught.value)
