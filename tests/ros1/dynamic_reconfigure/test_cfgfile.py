"""Running ``.cfg`` files in this process, and what is said of those that fail."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rosz.errors import SourceError
from rosz.ros1.client.dynamic_reconfigure import find_files
from rosz.ros1.client.dynamic_reconfigure.cfgfile import load, run
from rosz.ros1.importer import install, uninstall

from .cfg_samples import BROKEN, OLD, SAMPLES


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package on the path, and ROS 1's names to import."""
    made = tmp_path / "sample"
    (made / "cfg").mkdir(parents=True)
    (made / "package.xml").write_text("<package><name>sample</name></package>")
    monkeypatch.setenv("ROSZ_PACKAGE_PATH", str(tmp_path))
    uninstall()  # another test's, which knows another path
    install()
    yield made
    uninstall()


def write(folder: Path, name: str, text: str) -> Path:
    file = folder / "cfg" / f"{name}.cfg"
    file.write_text(text)
    return file


@pytest.mark.parametrize(("text", "line", "reason"), BROKEN)
def test_a_file_that_fails_is_named_with_its_line(
    folder: Path, text: str, line: int, reason: str
) -> None:
    file = write(folder, "Broken", text)
    with pytest.raises(SourceError) as caught:
        run(file)
    assert caught.value.path == str(file)
    assert caught.value.line == line
    assert caught.value.reason.startswith(reason)


def test_a_file_that_describes_nothing(folder: Path) -> None:
    file = write(folder, "Nothing", "from dynamic_reconfigure.parameter_generator_catkin import *")
    with pytest.raises(SourceError, match=r"it describes nothing; expected gen\.generate\("):
        run(file)


@pytest.mark.parametrize(("content", "reason"), [(b"\xff\xfe", "utf-8"), (b"a\0b", "null bytes")])
def test_a_file_that_is_no_text(folder: Path, content: bytes, reason: str) -> None:
    file = folder / "cfg" / "Bad.cfg"
    file.write_bytes(content)
    with pytest.raises(SourceError, match=reason):
        run(file)


def test_a_file_that_is_not_there(folder: Path) -> None:
    with pytest.raises(SourceError, match="cannot be read: No such file"):
        run(folder / "none.cfg")


def test_running_leaves_no_trace(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = SAMPLES["Tutorials"].replace(
        "exit(", "sys.path.append('here')\nprint('hello', 1, sep='-')\nexit("
    )
    path, argv, main = list(sys.path), list(sys.argv), sys.modules["__main__"]
    (one,) = run(write(folder, "Tutorials", text))
    assert (one.package, one.node, one.name) == ("sample", "dynamic_tutorials", "Tutorials")
    assert (sys.path, sys.argv, sys.modules["__main__"]) == (path, argv, main)
    assert not sys.stdin.closed
    assert capsys.readouterr() == ("", "hello-1\n")


def test_the_generator_of_before_catkin(folder: Path) -> None:
    module = load("sample.cfg.OldConfig", [write(folder, "Old", OLD)])
    assert (module.defaults, module.max) == ({"speed": 3}, {"speed": 9})


def test_several_of_one_file(folder: Path) -> None:
    text = SAMPLES["Tutorials"].replace("exit(", "gen.generate(PACKAGE, '', 'Other')\nexit(")
    assert [one.name for one in run(write(folder, "Tutorials", text))] == ["Other", "Tutorials"]


def test_files_are_told_from_others_of_that_ending(folder: Path) -> None:
    ours = write(folder, "Tutorials", SAMPLES["Tutorials"])
    write(folder, "setup", "[flake8]\nmax-line-length = 100\n")
    (folder / "cfg" / "folder.cfg").mkdir()
    (folder / "cfg" / "gone.cfg").symlink_to(folder / "nowhere")
    deep = folder / "config" / "deep" / "Enums.cfg"
    deep.parent.mkdir(parents=True)
    deep.write_text(SAMPLES["Enums"])
    assert find_files(folder) == [ours, deep]


def test_a_file_of_the_modules_name_comes_first(folder: Path) -> None:
    write(folder, "Another", SAMPLES["Tutorials"])
    named = write(folder, "Tutorials", SAMPLES["Tutorials"])
    assert load("sample.cfg.TutorialsConfig", find_files(folder)).__file__ == str(named)


def test_the_name_given_to_generate_counts(folder: Path) -> None:
    file = write(folder, "lower_case", SAMPLES["Tutorials"])
    write(folder, "Broken", "import dynamic_reconfigure\n1 / 0")
    files = find_files(folder)
    assert load("sample.cfg.TutorialsConfig", files).__file__ == str(file)
    with pytest.raises(ModuleNotFoundError) as caught:
        load("sample.cfg.lower_caseConfig", files)
    assert str(caught.value).startswith("no module named 'sample.cfg.lower_caseConfig': ")
    assert f"{file} generates TutorialsConfig" in str(caught.value)
    assert "ZeroDivisionError" in str(caught.value)
