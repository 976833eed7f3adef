from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from .shell import Shell

PROGRAM = """
from counting.msg import Num
from counting.srv import Add
num = Num(num=7)
assert Num.from_cdr(num.to_cdr()) == num
print(Add.Response(sum=num).sum.num)
"""


@pytest.fixture
def package(shell: Shell) -> Path:
    """A package with a message and a service, in a workspace that the shell stands in."""
    folder = shell.network.folder / "src" / "counting"
    for name, text in (
        ("msg/Num.msg", "Header header\nint64 num\ngeometry_msgs/Point[] way\n"),
        ("srv/Add.srv", "int64 a\n---\nNum sum\n"),
    ):
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(text)
    (folder / "package.xml").write_text("<package><name>counting</name></package>")
    return folder


def test_the_modules_work_alone(shell: Shell, package: Path) -> None:
    written = shell("gen", "counting").lines
    folder = package / "src" / "counting"
    assert written == [str(folder / name) for name in ("__init__.py", "msg.py", "srv.py")]
    variables = shell.network.variables()
    variables["PYTHONPATH"] += f":{folder.parent}"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=variables, capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("7\n", "")


def test_check(shell: Shell, package: Path) -> None:
    result = shell("gen", "--check", "counting")
    assert result.code == 1
    assert f"{package / 'src' / 'counting' / 'msg.py'} is missing" in result.out
    shell("gen", "counting")
    assert shell("gen", "--check", "counting").lines == []
    (package / "msg" / "Num.msg").write_text("int64 other\n")
    result = shell("gen", "--check", "counting")
    assert result.code == 1
    assert f"{package / 'src' / 'counting' / 'msg.py'} is stale" in result.out


def test_the_package_around_the_working_folder(
    shell: Shell, package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(package / "msg")
    assert len(shell("gen").lines) == 3
    monkeypatch.chdir(shell.network.folder)
    assert shell("gen").code == 2


def test_an_output_folder(shell: Shell, package: Path, tmp_path: Path) -> None:
    assert shell("gen", "-o", str(tmp_path), str(package)).lines[0] == str(
        tmp_path / "counting" / "__init__.py"
    )
    assert not (package / "src").exists()


def test_files_written_by_hand_stay(shell: Shell, package: Path) -> None:
    folder = package / "src" / "counting"
    folder.mkdir(parents=True)
    (folder / "mine.py").write_text("mine = 1\n")
    assert shell("gen", "counting").code == 0
    assert shell("gen", "--check", "counting").code == 0
    (folder / "msg.py").write_text("mine = 2\n")
    result = shell("gen", "counting")
    assert result.code == 2
    assert f"'{folder / 'msg.py'}' was not generated, and is not overwritten" in result.err
    assert (folder / "msg.py").read_text() == "mine = 2\n"


def test_generated_modules_are_removed_with_their_definitions(shell: Shell, package: Path) -> None:
    shell("gen", "counting")
    (package / "srv" / "Add.srv").unlink()
    result = shell("gen", "--check", "counting")
    assert f"{package / 'src' / 'counting' / 'srv.py'} has no definitions any more" in result.out
    shell("gen", "counting")
    assert not (package / "src" / "counting" / "srv.py").exists()


def test_a_package_without_definitions(shell: Shell, package: Path) -> None:
    (package.parent / "bare").mkdir()
    (package.parent / "bare" / "package.xml").write_text("<package><name>bare</name></package>")
    result = shell("gen", "bare")
    assert result.code == 1
    told = "ERROR: package 'bare' has no types of its own that modules could be made of"
    assert result.err == f"{told}\n"
    result = shell("gen", "std_msgs")
    told = told.replace("bare", "std_msgs")
    assert (result.code, result.err) == (1, f"{told}; rosz brings 'rosz.msgs.std_msgs'\n")


@pytest.mark.usefixtures("package")
def test_an_unknown_package_names_the_near_miss(shell: Shell) -> None:
    result = shell("gen", "countin")
    assert result.code == 1
    assert "did you mean 'counting'?" in result.err


def test_a_wrong_definition_is_reported_with_its_place(shell: Shell, package: Path) -> None:
    (package / "msg" / "Num.msg").write_text("int65 num\n")
    result = shell("gen", "counting")
    assert result.code == 1
    assert f"{package / 'msg' / 'Num.msg'}:1:1" in result.err


@pytest.mark.parametrize("name", ["empty", "file"])
def test_a_folder_or_file_that_is_not_a_package(shell: Shell, name: str) -> None:
    (shell.network.folder / "empty").mkdir()
    (shell.network.folder / "file").touch()
    done = shell("gen", str(shell.network.folder / name))
    assert done.code == 1
    assert f"'{shell.network.folder / name}' is not a package: it has no package.xml; " in done.err
