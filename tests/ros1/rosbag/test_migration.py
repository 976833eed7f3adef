"""rosbag.migration: bags of older definitions, on real ROS 1 and on rosz."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from oracle import PYTHON, require

import rosz.ros1.rosbag as rosbag_here
from rosz.ros1.rosbag import (
    Bag,
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
)
from rosz.ros1.rosbag.programs import run_fixbag, run_makerule, run_savemsg

RULE = "=" * 80
NOW = {
    "Part": "float64 weight\nstring label\n",
    "Robot": "Part arm\nPart[] parts\nint32 id\n",
    "Gripper": "int32 WIDE=2\nint32 width\n",
    "Moved": "int32 x\nint32 y\n",
    "Same": "int32 a\n",
}
OLD_PART = "float32 weight\n"
OLD_ROBOT = f"Part arm\nPart[] parts\nint32 id\n{RULE}\nMSG: lab_msgs/Part\n{OLD_PART}"
OLD_GRIPPER = "int32 WIDE=1\nint32 width\n"
OLD_MOVED = "int32 x\n"
RULES = f'''
class update_part(MessageUpdateRule):
    old_type = "lab_msgs/Part"
    old_full_text = """{OLD_PART}"""
    new_type = "lab_msgs/Part"
    new_full_text = """float32 weight
string name
"""
    order = 1
    migrated_types = []
    valid = True
    def update(self, old_msg, new_msg):
        new_msg.weight = old_msg.weight * 2
        new_msg.name = "none"

class update_part_2(MessageUpdateRule):
    old_type = "lab_msgs/Part"
    old_full_text = """float32 weight
string name
"""
    new_type = "lab_msgs/Part"
    new_full_text = """{NOW["Part"]}"""
    order = 2
    migrated_types = []
    valid = True
    def update(self, old_msg, new_msg):
        new_msg.weight = old_msg.weight
        new_msg.label = old_msg.name.upper()

class rename_origin(MessageUpdateRule):
    old_type = "lab_msgs/Origin"
    old_full_text = """{OLD_MOVED}"""
    new_type = "lab_msgs/Moved"
    new_full_text = """{NOW["Moved"]}"""
    order = 0
    migrated_types = []
    valid = True
    def update(self, old_msg, new_msg):
        new_msg.x = old_msg.x
        new_msg.y = -1
'''
SCRIPT = """
import json, sys, types
from genpy.dynamic import generate_dynamic
folder, now, old_part, old_robot, old_gripper, old_moved = json.loads(sys.argv[1])
package = sys.modules["lab_msgs"] = types.ModuleType("lab_msgs")
package.msg = sys.modules["lab_msgs.msg"] = types.ModuleType("lab_msgs.msg")
rule = "\\n" + "=" * 80 + "\\n"
for name, text in now.items():
    whole = text + (rule + "MSG: lab_msgs/Part\\n" + now["Part"] if name == "Robot" else "")
    setattr(package.msg, name, generate_dynamic("lab_msgs/" + name, whole)["lab_msgs/" + name])
import rosbag, rospy
from rosbag import migration

def old(name, text):
    return generate_dynamic(name, text)

robot = old("lab_msgs/Robot", old_robot)
part = robot["lab_msgs/Part"]
messages = {
    "robot": robot["lab_msgs/Robot"](part(1.5), [part(1.0), part(2.0)], 7),
    "part": part(4.0),
    "gripper": old("lab_msgs/Gripper", old_gripper)["lab_msgs/Gripper"](3),
    "origin": old("lab_msgs/Origin", old_moved)["lab_msgs/Origin"](5),
    "gone": old("lab_msgs/Gone", "int32 z\\n")["lab_msgs/Gone"](6),
    "same": package.msg.Same(1),
}
for name, message in messages.items():
    with rosbag.Bag(f"{folder}/{name}.bag", "w") as bag:
        bag.write(name, message, rospy.Time(5))

def plain(value):
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    return [plain(one) for one in value] if isinstance(value, (list, tuple)) else value

def key(cls):
    return list(migration.get_message_key(cls) or [])

found = {}
for rules in ([], [folder + "/rules.bmr"]):
    migrator = migration.MessageMigrator(rules, False)
    for name, message in messages.items():
        bag, made = f"{folder}/{name}.bag", f"{folder}/{name}.{len(rules)}.bag"
        checked = migration.checkbag(migrator, bag)
        row = [
            # ROS 1 also has steps between definitions that differ in comments.
            [[key(n.old_class) + key(n.new_class) for n in path
              if key(n.old_class) != key(n.new_class)] for path, _ in checked],
            [sorted(key(r.old_class) + key(r.new_class) for r in bad) for _, bad in checked],
            sorted(
                [line.strip() for r in bad for line in r.get_class_def().split("\\n")
                 if "new_msg." in line and "#" not in line and "''" not in line]
                for _, bad in checked
            ),
        ]
        try:
            row.append(migration.fixbag(migrator, bag, made))
        except Exception as error:
            row.append(type(error).__name__)
        if row[-1] is True:
            with rosbag.Bag(made) as bag:
                row.append([
                    [topic, m._type, plain(m), t.to_nsec(), header["md5sum"].decode()]
                    for topic, m, t, header in bag.read_messages(return_connection_header=True)
                ])
        found[f"{name} {len(rules)}"] = row
    found[f"valid {len(rules)}"] = migrator.all_rules_valid()
    found[f"target {len(rules)}"] = [key(migrator.find_target(type(m))) for m in messages.values()]
for name in ("wrong.bmr", "invalid.bmr", "missing.bmr"):
    try:
        migration.MessageMigrator([f"{folder}/{name}"], False)
        found[name] = "made"
    except migration.BagMigrationException:
        found[name] = "refused"
migrator = migration.MessageMigrator([folder + "/rules.bmr"], False)
path = f"{folder}/forced.bag"
found["names"] = [
    migration.clean_name("std_msgs/Header", "a/B"), migration.clean_name("a/C", "a/B"),
    migration.qualified_name("C", "a/B"), migration.qualified_name("Header", "a/B"),
    migration.qualified_name("int32", "a/B"), migration.qualified_name("d/C", "a/B"),
    sorted(map(str, migration.constants_from_def("a/B", "int32 X=3\\nstring Y=hello\\nint8 z\\n"))),
    [*map(migration.migration_default_value, ("int8", "float32", "int8[2]", "a/B", "float64[]"))],
]
with open(folder + "/result.json", "w") as file:
    json.dump(found, file)
"""


def write(folder: Path) -> list[Any]:
    """Write the rules and the package; return the arguments of the script."""
    folder.mkdir()
    (folder / "rules.bmr").write_text(RULES)
    (folder / "wrong.bmr").write_text("class (")
    (folder / "invalid.bmr").write_text(RULES.replace("valid = True", "valid = False", 1))
    package = folder / "src" / "lab_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package format='2'><name>lab_msgs</name><version>1.0.0</version>"
        "<description>d</description><maintainer email='a@b.c'>a</maintainer>"
        "<license>x</license></package>"
    )
    for name, text in NOW.items():
        (package / "msg" / f"{name}.msg").write_text(text)
    (folder / "script.py").write_text(SCRIPT)
    return [str(folder), NOW, OLD_PART, OLD_ROBOT, OLD_GRIPPER, OLD_MOVED]


def results(folder: Path, *command: str) -> dict[str, Any]:
    arguments = json.dumps(write(folder))
    environ = {
        **os.environ,
        "ROSZ_PACKAGE_PATH": str(folder / "src"),
        "ROS_PACKAGE_PATH": f"{folder / 'src'}:/usr/share",
    }
    done = subprocess.run(
        [*command, str(folder / "script.py"), arguments],
        env=environ,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads((folder / "result.json").read_text())
    return found


@pytest.mark.ros1
def test_bags_are_migrated_as_by_ros_1(tmp_path: Path) -> None:
    require("rosbag.migration", package="python3-rosbag")
    theirs = results(tmp_path / "theirs", PYTHON)
    mine = results(tmp_path / "mine", sys.executable, "-P", "-m", "rosz.ros1")
    for name, expected in theirs.items():
        assert mine[name] == expected, name
    assert mine["robot 1"][3] is True
    assert mine["robot 1"][4][0][2]["parts"][1] == {"weight": 4.0, "label": "NONE"}
    assert mine["origin 1"][4][0][1:3] == ["lab_msgs/Moved", {"x": 5, "y": -1}]
    assert mine["gripper 0"][3] is False


def test_the_programs_of_ros_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bag of an older std_msgs/String: its text is saved, a rule made, completed and used."""
    from rosz.ros1.genpy import generate_dynamic

    monkeypatch.chdir(tmp_path)
    old = generate_dynamic("std_msgs/String", "string text\n")["std_msgs/String"]
    with Bag("old.bag", "w") as bag:
        bag.write("chatter", old("hello"))
    assert run_fixbag(["old.bag", "new.bag"]) == 1
    assert capsys.readouterr().out == "Bag could not be migrated.\n"
    assert not Path("new.bag").exists()
    assert run_savemsg(["-b", "old.bag", "std_msgs/String"]) == 0
    Path("saved").write_text(capsys.readouterr().out)
    assert Path("saved").read_text() == "[std_msgs/String]:\nstring text\n\n"
    assert run_makerule(["saved", "rule.bmr", "-n"]) == 0
    assert "1 rules missing" in capsys.readouterr().out
    assert run_makerule(["saved", "rule.bmr", "-n"]) == 1
    assert "already exists; -a adds" in capsys.readouterr().err
    rule = Path("rule.bmr").read_text()
    assert "valid = False" in rule
    rule = rule.replace("valid = False", "valid = True")
    Path("rule.bmr").write_text(rule.replace("new_msg.data = ''", "new_msg.data = old_msg.text"))
    assert run_fixbag(["old.bag", "new.bag", "rule.bmr"]) == 0
    with Bag("new.bag") as bag:
        ((topic, message, _),) = bag.read_messages()
    assert (topic, message.data) == ("chatter", "hello")
    assert run_fixbag(["old.bag", "rule.bmr"]) == 2
    assert run_fixbag(["missing.bag", "x.bag"]) == 1
    assert "missing.bag" in capsys.readouterr().err
    assert run_savemsg(["nothing/Such"]) == 1


def test_encryption_is_refused(tmp_path: Path) -> None:
    with Bag(str(tmp_path / "x.bag"), "w") as bag:
        bag.set_encryptor()
        bag.set_encryptor("rosbag/NoEncryptor")
        with pytest.raises(ROSBagEncryptNotSupportedException, match="does not encrypt bags"):
            bag.set_encryptor("rosbag/AesCbcEncryptor", "*user")
    path = tmp_path / "x.bag"
    data = path.read_bytes()
    field = b"encryptor=rosbag/AesCbcEncryptor"
    size = len(field) + 4
    head = int.from_bytes(data[13:17], "little")
    # The padding behind the header makes room for the field.
    body = data[17 : 17 + head] + len(field).to_bytes(4, "little") + field
    padding = int.from_bytes(data[17 + head : 21 + head], "little") - size
    rest = data[21 + head + size :]
    path.write_bytes(
        data[:13]
        + (head + size).to_bytes(4, "little")
        + body
        + padding.to_bytes(4, "little")
        + rest
    )
    with pytest.raises(ROSBagEncryptNotSupportedException, match="'rosbag decrypt' of ROS 1"):
        Bag(str(path))
    assert issubclass(ROSBagEncryptException, ROSBagException)


def test_bags_are_written_to_streams(tmp_path: Path) -> None:
    from rosz.msgs.std_msgs.msg import Int32

    path = tmp_path / "x.bag"
    with path.open("wb") as stream, Bag(stream, "w") as bag:
        assert bag.get_message_count() == 0
        with pytest.raises(ROSBagException, match="Bag contains no message"):
            bag.get_start_time()
        bag.write("/int", Int32(data=5))
    with path.open("rb") as source, Bag(source) as bag:
        assert [message.data for _, message, _ in bag] == [5]


def test_the_names_of_ros_1_are_there() -> None:
    for name in ("Bag", "Compression", "rosbagmain", "migration", "ROSBagUnindexedException"):
        assert hasattr(rosbag_here, name)
