from __future__ import annotations

import concurrent.futures
import os
import pickle
import subprocess
import sys
import traceback
from pathlib import Path

import pytest

from rosz.errors import DefinitionError, InvalidName, PackageNotFound, TypeNotFound
from rosz.message import Message, Service
from rosz.msgs.geometry_msgs.msg import Point
from rosz.msgs.std_msgs.msg import Header, String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.packages import PackageIndex
from rosz.typestore import TypeStore

TOP = Path(__file__).parents[1]


def package(root: Path, name: str, files: dict[str, str]) -> Path:
    folder = root / name
    for file, text in files.items():
        kind = file.rpartition(".")[2]
        (folder / kind).mkdir(parents=True, exist_ok=True)
        (folder / kind / file).write_text(text)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    return folder


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    root = tmp_path / "src"
    package(
        root,
        "gripper_msgs",
        {
            "Grip.msg": "uint8 SOFT=1\nHeader header\nshared_msgs/Part[] parts\nPoint point\n",
            "Point.msg": "float32 x\n",
            "Close.srv": "Grip grip\n---\nbool success\n",
        },
    )
    package(root, "shared_msgs", {"Part.msg": "geometry_msgs/Point at\nduration age\n"})
    package(root, "no_types", {})
    return root


def forget() -> None:
    """Forget what was compiled, as a new process would not know it."""
    for name in [name for name in sys.modules if name.startswith("rosz.msgs.")]:
        if hasattr(sys.modules[name], "_made_of"):
            del sys.modules[name]


def store(root: Path, cache: Path | None = None) -> TypeStore:
    forget()
    return TypeStore(PackageIndex([root]), cache)


def test_shipped_types() -> None:
    types = TypeStore()
    assert types.message("std_msgs/String") is types.message("std_msgs/msg/String") is String
    assert types.service("std_srvs/SetBool") is types.service("std_srvs/srv/SetBool") is SetBool
    assert issubclass(types.message("sensor_msgs/Image"), Message)
    assert issubclass(types.service("nav_msgs/GetPlan"), Service)


def test_types_of_a_package(workspace: Path) -> None:
    types = store(workspace)
    grip = types.message("gripper_msgs/Grip")
    part = types.message("shared_msgs/msg/Part")
    own_point = types.message("gripper_msgs/Point")
    made = grip(Header(frame_id="map"), [part(Point(1.0, 2.0, 3.0))], own_point(0.5))
    assert grip.from_cdr(made.to_cdr()) == made
    assert grip._schema[0][1] is Header
    assert (grip._type, grip._type_name) == ("gripper_msgs/Grip", "gripper_msgs/msg/Grip")
    close = types.service("gripper_msgs/Close")
    assert close.Request(made).to_cdr()
    assert types.message("gripper_msgs/Grip") is grip
    assert types.module("gripper_msgs", "msg").Grip.SOFT == 1


def test_names_and_packages(workspace: Path) -> None:
    types = store(workspace)
    assert types.names("msg", "gripper_msgs") == ["gripper_msgs/Grip", "gripper_msgs/Point"]
    assert types.names("srv", "gripper_msgs") == ["gripper_msgs/Close"]
    assert types.names("srv", "shared_msgs") == []
    assert {"std_msgs/String", "gripper_msgs/Grip"} <= set(types.names("msg"))
    assert types.names("msg") == sorted(types.names("msg"))
    assert {"std_msgs", "std_srvs", "gripper_msgs", "shared_msgs"} <= set(types.packages())
    assert "no_types" not in types.packages()
    assert "std_srvs" not in types.packages("msg")
    assert types.has("gripper_msgs", "srv")
    assert not types.has("shared_msgs", "srv")
    with pytest.raises(PackageNotFound, match="did you mean 'gripper_msgs'"):
        types.names("msg", "griper_msgs")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("String", "expected a name such as 'package/Type' of a msg"),
        ("std_msgs/srv/String", "expected a name such as 'package/Type' of a msg"),
        ("std_msgs/a/b/c", "expected a name such as"),
        ("std_msgs/Strin", "package 'std_msgs' has no such msg; did you mean 'String'?"),
        ("gripper_msgs/Gripp", "package 'gripper_msgs' has no such msg; did you mean 'Grip'?"),
        ("gripper_msgs/Xyz", "has no such msg; it has Grip, Point"),
        ("std_mgs/String", "there is no package 'std_mgs'; did you mean 'std_msgs'?"),
        ("nowhere/Xyz", "there is no package 'nowhere'; add its folder to ROSZ_PACKAGE_PATH"),
        ("no_types/Xyz", "package 'no_types' has no msg at all"),
        ("std_srvs/SetBool", "package 'std_srvs' has no msg at all"),
    ],
)
def test_unknown_messages(workspace: Path, name: str, expected: str) -> None:
    with pytest.raises(TypeNotFound) as caught:
        store(workspace).message(name)
    assert expected in str(caught.value)
    assert caught.value.type_name == name


def test_a_bad_definition_is_shown_with_its_place(workspace: Path) -> None:
    file = workspace / "gripper_msgs" / "msg" / "Bad.msg"
    file.write_text("int32 x\n\n  shared_msgs/Prat p\n")
    types = store(workspace)
    with pytest.raises(DefinitionError) as caught:
        types.message("gripper_msgs/Bad")
    text = str(caught.value)
    assert text.startswith(f"{file}:3:3: type 'shared_msgs/Prat' of field 'p': type 'shared_msgs/")
    assert text.endswith("has no 'Prat.msg'; did you mean 'Part'?")


@pytest.mark.parametrize("kept", [False, True])
def test_bad_definitions_fail_alone(workspace: Path, tmp_path: Path, *, kept: bool) -> None:
    folder = workspace / "gripper_msgs" / "msg"
    (folder / "Bad.msg").write_text("int32 x y\n")
    (folder / "HasBad.msg").write_text("int32 n\nBad bad\n")
    (folder / "Not-a-name.msg").write_text("int32 x\n")
    (folder / "Latin1.msg").write_bytes(b"# \xe9t\xe9\n")
    (workspace / "gripper_msgs" / "srv" / "Bad.srv").write_text("Grip g\nBad b\n---\n")
    cache = tmp_path / "cache" if kept else None
    for _ in range(2):
        types = store(workspace, cache)
        grip = types.message("gripper_msgs/Grip")
        assert grip.from_cdr(grip().to_cdr()) == grip()
        assert types.service("gripper_msgs/Close").Request().grip == grip()  # type: ignore[attr-defined]
        module = types.module("gripper_msgs", "msg")
        assert module.Point is types.message("gripper_msgs/Point")
        assert module.__all__ == ("Grip", "Point")
        with pytest.raises(DefinitionError) as caught:
            types.message("gripper_msgs/HasBad")
        assert str(caught.value).startswith(f"{folder}/Bad.msg:1:9: field 'x': expected")
        with pytest.raises(DefinitionError, match=r"Bad\.msg:1:9: field 'x'"):
            _ = module.HasBad
        with pytest.raises(DefinitionError, match=r"Latin1\.msg:1:3: not UTF-8"):
            types.message("gripper_msgs/Latin1")
        with pytest.raises(DefinitionError, match=r"name\.msg: 'Not-a-name' cannot name a type"):
            _ = getattr(module, "Not-a-name")
        with pytest.raises(DefinitionError, match=r"Bad\.msg:1:9"):
            types.service("gripper_msgs/Bad")
        with pytest.raises(AttributeError, match=r"'gripper_msgs\.msg' has no attribute 'Other'"):
            _ = module.Other


def test_a_package_of_bad_definitions_is_refused(tmp_path: Path) -> None:
    package(tmp_path, "broken_msgs", {"A.msg": "int32\n", "B.msg": "int32\n"})
    with pytest.raises(DefinitionError, match=r"A\.msg:1:6"):
        store(tmp_path).module("broken_msgs", "msg")
    package(tmp_path, "std_msgs", {"Mine.msg": "int32\n"})
    module = store(tmp_path).module("std_msgs", "msg")
    assert module.String is String
    with pytest.raises(DefinitionError, match=r"Mine\.msg:1:6"):
        _ = module.Mine


def test_what_rosz_ships_comes_first(tmp_path: Path) -> None:
    """A copy of std_msgs in a workspace does not change the wire, but may add to the package."""
    package(tmp_path, "std_msgs", {"String.msg": "int32 other", "Mine.msg": "String text"})
    types = store(tmp_path)
    assert types.message("std_msgs/String") is String
    mine = types.message("std_msgs/Mine")
    assert mine(String("x")).to_cdr()
    assert types.module("std_msgs", "msg").String is String
    assert types.module("std_msgs", "msg").Mine is mine
    assert types.names("msg", "std_msgs")[-1] == "std_msgs/UInt8MultiArray"
    assert "std_msgs/Mine" in types.names("msg", "std_msgs")


def test_generated_sources_are_kept(workspace: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    first = store(workspace, cache).message("gripper_msgs/Grip")
    files = {file: file.stat().st_mtime_ns for file in cache.glob("*.py")}
    assert len(files) == 2
    second = store(workspace, cache).message("gripper_msgs/Grip")
    assert second._type_hash == first._type_hash
    assert {file: file.stat().st_mtime_ns for file in cache.glob("*.py")} == files
    assert not list(cache.glob("*.tmp"))


def test_a_changed_definition_is_generated_anew(workspace: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    before = store(workspace, cache).message("gripper_msgs/Grip")
    (workspace / "gripper_msgs" / "msg" / "Point.msg").write_text("float64 x\nfloat64 y\n")
    after = store(workspace, cache).message("gripper_msgs/Grip")
    assert after._type_hash != before._type_hash
    assert len(after().point.__slots__) == 2  # type: ignore[attr-defined]


def test_a_change_in_another_package_is_noticed(workspace: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    before = store(workspace, cache).message("gripper_msgs/Grip")
    (workspace / "shared_msgs" / "msg" / "Part.msg").write_text("string name\n")
    types = store(workspace, cache)
    after = types.message("gripper_msgs/Grip")
    assert after._type_hash != before._type_hash
    part = types.message("shared_msgs/Part")
    made = after(parts=[part("bolt")])
    assert after.from_cdr(made.to_cdr()) == made
    # Constants of a type do not change its layout, but the MD5 sum of all that hold it.
    (workspace / "shared_msgs" / "msg" / "Part.msg").write_text("uint8 A=1\nstring name\n")
    third = store(workspace, cache).message("gripper_msgs/Grip")
    assert third._type_hash == after._type_hash
    assert third._md5sum != after._md5sum


def test_another_generator_generates_anew(workspace: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    store(workspace, cache).message("shared_msgs/Part")
    newer = store(workspace, cache)
    newer._compiler.__dict__["_generation"] = b"of tomorrow"
    newer.message("shared_msgs/Part")
    assert len(list(cache.glob("*.py"))) == 2


@pytest.mark.parametrize("content", ["", "def broken(", "import no_such_module", "\0", "x = 1 / 0"])
def test_a_spoilt_cache_is_mended(workspace: Path, tmp_path: Path, content: str) -> None:
    cache = tmp_path / "cache"
    store(workspace, cache).message("shared_msgs/Part")
    (file,) = cache.glob("*.py")
    good = file.read_text()
    file.write_text(content)
    assert store(workspace, cache).message("shared_msgs/Part")().to_cdr()
    assert file.read_text() == good


def test_no_folder_to_write_to(workspace: Path, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    for cache in (None, blocked / "cache", Path("/proc/nothing/here")):
        assert store(workspace, cache).message("gripper_msgs/Grip")().to_cdr()


@pytest.mark.parametrize("kept", [True, False])
def test_tracebacks_show_generated_lines(workspace: Path, tmp_path: Path, *, kept: bool) -> None:
    class Broken:
        @property
        def at(self) -> Point:
            raise RuntimeError("out of order")

    types = store(workspace, tmp_path / "cache" if kept else None)
    grip = types.message("gripper_msgs/Grip")
    with pytest.raises(RuntimeError) as caught:
        grip(parts=[Broken()]).to_cdr()
    shown = "".join(traceback.format_exception(caught.value))
    assert "e_at" in shown.partition("gripper_msgs_msg_")[2].splitlines()[1]
    assert "gripper_msgs_msg_" in shown


def test_classes_can_be_pickled_in_their_process(workspace: Path) -> None:
    types = store(workspace)
    part = types.message("shared_msgs/Part")
    made = part(Point(1.0, 2.0, 3.0))
    assert pickle.loads(pickle.dumps(made)) == made


def test_stores_of_one_process_share_classes(workspace: Path, tmp_path: Path) -> None:
    first = store(workspace).message("gripper_msgs/Grip")
    packages = PackageIndex([workspace])
    assert TypeStore(packages, tmp_path / "cache").message("gripper_msgs/Grip") is first
    (workspace / "shared_msgs" / "msg" / "Part.msg").write_text("string name\n")
    assert TypeStore(packages).message("gripper_msgs/Grip") is not first


COMPILE = """
import sys
from pathlib import Path
from rosz.packages import PackageIndex
from rosz.typestore import TypeStore
cls = TypeStore(PackageIndex([Path(sys.argv[1])]), Path(sys.argv[2])).message("gripper_msgs/Grip")
print(cls._type_hash, cls.from_cdr(cls().to_cdr()) == cls())
"""


def test_many_processes_at_once(workspace: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"

    def run(_: int) -> str:
        return subprocess.run(
            [sys.executable, "-c", COMPILE, str(workspace), str(cache)],
            env={**os.environ, "PYTHONPATH": str(TOP)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout

    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        answers = set(pool.map(run, range(16)))
    assert len(answers) == 1
    assert answers.pop().endswith(" True\n")
    assert len(list(cache.glob("*.py"))) == 2
    assert not list(cache.glob("*.tmp"))


def test_definitions() -> None:
    types = TypeStore()
    assert types.definition("std_msgs/msg/String").text == String._text
    assert types.definition("std_srvs/srv/SetBool").path == "<std_srvs/srv/SetBool>"
    with pytest.raises(TypeNotFound, match="there is no package 'nowhere'"):
        types.definition("nowhere/msg/X")


SCAN = """\
uint8 FAST=2
Header header
Beam[] beams
other_msgs/Beam last
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id

================================================================================
MSG: scan_msgs/Beam
float32 range
geometry_msgs/Point end
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: other_msgs/Beam
duration age
"""


def test_a_message_from_a_full_text() -> None:
    types = TypeStore()
    scan = types.message_from_text("scan_msgs/Scan", SCAN)
    assert (scan._type, scan._type_name) == ("scan_msgs/Scan", "scan_msgs/msg/Scan")
    beam, other = scan._schema[1][1], scan._schema[2][1]
    assert isinstance(beam, type)
    assert isinstance(other, type)
    assert (beam._type, other._type) == ("scan_msgs/Beam", "other_msgs/Beam")
    assert scan._schema[0][1] is Header
    assert beam._schema[1][1] is Point
    made = scan(Header(frame_id="map"), [beam(1.5, Point(1.0, 2.0, 3.0))])
    assert scan.from_cdr(made.to_cdr()) == made == pickle.loads(pickle.dumps(made))
    assert "MSG: other_msgs/Beam" in scan._full_text


def test_names_of_types_that_are_too_long(tmp_path: Path) -> None:
    types = TypeStore(cache=tmp_path)
    longer_than_names_of_files = f"mine/N{'x' * 900}"
    assert types.message_from_text(longer_than_names_of_files, "int32 a\n")(1)._type_name
    for name in (f"mine/N{'x' * 66_000}", f"std_msgs/N{'x' * 66_000}"):
        with pytest.raises(InvalidName, match="the limit is 1024"):
            types.message_from_text(name, "int32 a\n")
        with pytest.raises(InvalidName, match="the limit is 1024"):
            types.message(name)


def test_a_class_from_a_text_is_made_once(tmp_path: Path) -> None:
    forget()
    scan = TypeStore(cache=tmp_path).message_from_text("scan_msgs/Scan", SCAN)
    assert TypeStore(cache=tmp_path).message_from_text("scan_msgs/msg/Scan", SCAN) is scan
    changed = SCAN.replace("float32 range", "float64 range")
    assert TypeStore().message_from_text("scan_msgs/Scan", changed) is not scan
    assert list(tmp_path.glob("scan_msgs_msg_Scan_*.py"))


def test_a_text_of_a_known_type_gives_the_known_class() -> None:
    types = TypeStore()
    assert types.message_from_text("std_msgs/String", String._full_text) is String
    assert types.service_from_text("std_srvs/SetBool", SetBool._text) is SetBool
    longer = types.message_from_text("std_msgs/String", "string data\nint8 more\n")
    assert longer is not String
    assert longer._type == String._type


def test_a_service_from_texts_by_name() -> None:
    others = {"arm_msgs/msg/Pose": "Joint[] joints\n", "arm_msgs/msg/Joint": "float64 angle\n"}
    move = TypeStore().service_from_text("arm_msgs/srv/Move", "Pose to\n---\nbool done\n", others)
    pose = move.Request._schema[0][1]
    assert isinstance(pose, type)
    assert pose._type_name == "arm_msgs/msg/Pose"
    assert move.Response(done=True).to_cdr() == bytes([0, 1, 0, 0, 1])


def test_types_of_a_text_come_from_the_store_too(workspace: Path) -> None:
    types = store(workspace)
    made = types.message_from_text("box_msgs/Box", "shared_msgs/Part[] parts\n")
    assert made._schema[0][1] is types.message("shared_msgs/Part")


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("Scan", "int8 x", "expected a name such as 'package/Type' of a msg"),
        ("scan_msgs/srv/Scan", "int8 x", "expected a name such as 'package/Type' of a msg"),
        ("scan_msgs/Scan", "int8", "<scan_msgs/msg/Scan>:1:5: expected a name after type 'int8'"),
        ("scan_msgs/Scan", "Beam beam", "type 'Beam' of field 'beam'"),
    ],
)
def test_a_text_that_is_refused(name: str, text: str, reason: str) -> None:
    with pytest.raises((TypeNotFound, DefinitionError)) as caught:
        TypeStore().message_from_text(name, text)
    assert reason in str(caught.value)
