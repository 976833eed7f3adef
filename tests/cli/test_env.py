from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from network import Network

from rosz.cli import env
from rosz.cli.env import ALIASES

from .shell import Shell, with_log

BIN = Path(env.__file__).parent / "bin"
ENV = f"{sys.executable} -P -m rosz env"


def evaluate(
    network: Network, shell: str, *lines: str, timeout: float = 300
) -> subprocess.CompletedProcess[str]:
    """Run lines in a shell that has evaluated what rosz prints for it."""
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed: apt install {shell}")
    first = f"{ENV} fish | source" if shell == "fish" else f'eval "$({ENV} {shell})"'
    return subprocess.run(
        [shell, "-c", "\n".join([first, *lines])],
        env=network.variables(),
        cwd=network.folder,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


@pytest.mark.parametrize("command", ALIASES)
def test_the_programs_are_those_of_the_table(command: str) -> None:
    line = f'exec "${{ROSZ_PYTHON:-python3}}" -P -m rosz {ALIASES[command]} "$@"'
    assert (BIN / command).read_text() == f"#!/bin/sh\n{line}\n"


def test_all_programs_may_be_executed() -> None:
    found = {path.name for path in BIN.iterdir()}
    assert found == {*ALIASES, "rospack", "rosls", "rosed"}
    assert all(path.stat().st_mode & 0o111 == 0o111 for path in BIN.iterdir())


def test_rosparam_is_the_same_by_every_route(network: Network) -> None:
    python = f"{sys.executable} -P -m rosz"
    routes = f"{python} param", "rosparam", "rosrun rosparam rosparam", f"{python}.ros1 rosparam"
    rosz, *others = (evaluate(network, "bash", f"{route} list") for route in routes)
    assert rosz.returncode == 1
    assert rosz.stderr.startswith("ERROR: nobody answers at ")
    assert [(one.returncode, one.stderr) for one in others] == [(1, rosz.stderr)] * len(others)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_ros_1_names_mean_rosz(network: Network, shell: str) -> None:
    with_log(network.node("talker"))
    done = evaluate(
        network,
        shell,
        "rosnode list",
        "timeout 300 rostopic list",
        "rosmsg show std_msgs/Bool",
        "roscd std_msgs/msg && pwd",
        "rosls std_msgs/msg | grep -x Bool.msg",
        "rospack find std_msgs",
    )
    assert done.stderr == ""
    *lines, here, file, found = done.stdout.splitlines()
    assert lines == ["/talker", "/rosout", "bool data", ""]
    assert here == f"{found}/msg"
    assert file == "Bool.msg"


def test_evaluating_twice_changes_nothing(network: Network) -> None:
    again = f'eval "$({ENV} bash)"'
    done = evaluate(
        network,
        "bash",
        again,
        'echo "$PATH" | tr ":" "\\n" | grep -c cli/bin',
        'echo "$PYTHONPATH" | tr ":" "\\n" | grep -c ros1/shell',
    )
    assert done.stdout == "1\n1\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_that_is_run_directly_finds_rospy(network: Network, shell: str) -> None:
    script = network.folder / "first.py"
    script.write_text(
        f"#!{sys.executable}\nfrom std_msgs.msg import String\nimport rospy\n"
        "rospy.init_node('first')\nprint(rospy.get_name(), String('x').data)\n"
    )
    script.chmod(0o755)
    done = evaluate(network, shell, "./first.py")
    assert (done.stdout, done.stderr) == ("/first x\n", "")


def test_other_scripts_load_nothing_of_rosz(network: Network) -> None:
    line = "import json, sys; print([name for name in sys.modules if name.startswith('rosz')])"
    done = evaluate(network, "bash", f'"$ROSZ_PYTHON" -c "{line}"')
    assert (done.stdout, done.stderr) == ("[]\n", "")


@pytest.mark.parametrize("name", ["platform", "subprocess", "msgspec"])
def test_modules_that_rosz_provides_optionally_load_nothing(network: Network, name: str) -> None:
    folder = network.folder / "odd"
    folder.mkdir()
    source = "try:\n    import of_another_system\nexcept ImportError:\n    half = True\n"
    (folder / f"{name}.py").write_text(source)
    line = f"import {name}, sys; print({name}.half, 'rosz' in sys.modules)"
    done = evaluate(network, "bash", f'PYTHONPATH="odd:$PYTHONPATH" "$ROSZ_PYTHON" -c "{line}"')
    assert (done.stdout, done.stderr) == ("True False\n", "")


def test_a_missing_module(network: Network) -> None:
    done = evaluate(network, "bash", '"$ROSZ_PYTHON" -c "import nothing_of_the_kind"')
    assert done.stderr.endswith("ModuleNotFoundError: No module named 'nothing_of_the_kind'\n")


def test_a_sitecustomize_of_the_user_runs_as_well(network: Network) -> None:
    (network.folder / "sitecustomize.py").write_text("print('mine')\n")
    line = 'PYTHONPATH="$PYTHONPATH:." "$ROSZ_PYTHON" -c "import rospy; print(rospy.get_name())"'
    assert evaluate(network, "bash", line).stdout == "mine\n/unnamed\n"


def test_two_installations_of_rosz_on_the_path(network: Network) -> None:
    shutil.copytree(BIN.parents[1] / "ros1" / "shell", network.folder / "b")
    (network.folder / "sitecustomize.py").write_text("print('mine')\n")
    line = (
        'PYTHONPATH="$PYTHONPATH:b:$PYTHONPATH:." "$ROSZ_PYTHON" -c'
        ' "import rospy; print(rospy.get_name())"'
    )
    done = evaluate(network, "bash", line)
    assert (done.stdout, done.stderr) == ("mine\n/unnamed\n", "")


def test_ctrl_c_before_a_command_or_script_begins(network: Network) -> None:
    press = "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n"
    (network.folder / "sitecustomize.py").write_text(press)
    for line in ('"$ROSZ_PYTHON" -c "import rospy"', "rostopic list"):
        done = evaluate(network, "bash", f'PYTHONPATH="$PYTHONPATH:." {line}; echo $?')
        assert (done.stdout, done.stderr) == ("130\n", "")


def test_ctrl_c_while_the_script_of_the_command_imports(network: Network) -> None:
    (network.folder / "bin").mkdir()
    press = "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\nprint('goes on')\n"
    (network.folder / "bin" / "rosz").write_text(press)
    done = evaluate(network, "bash", '"$ROSZ_PYTHON" ./bin/rosz; echo $?')
    assert (done.stdout, done.stderr) == ("130\n", "")


@pytest.mark.parametrize("module", ["rosz.interrupts", "rosz.ros1.importer", "rosz.node"])
def test_ctrl_c_while_a_script_imports_rospy(network: Network, module: str) -> None:
    (network.folder / "listener.py").write_text(
        "import os, signal, sys\n"
        "class Press:\n"
        "    def find_spec(self, name, path, target=None):\n"
        f"        if name == '{module}':\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Press())\n"
        "import rospy\n"
        "print('goes on')\n"
    )
    done = evaluate(network, "bash", '"$ROSZ_PYTHON" listener.py; echo $?')
    assert (done.stdout, done.stderr) == ("130\n", "")


@pytest.mark.parametrize(
    "line",
    [
        "roscd",
        "roscd nope",
        "rosls",
        "rosls nope",
        "rospack",
        "rospack find",
        "rospack find nope",
        "rosed std_msgs",
    ],
)
def test_errors_are_reported(network: Network, line: str) -> None:
    done = evaluate(network, "bash", line)
    assert done.returncode in {1, 2}
    assert not done.stdout
    reasons = "usage: ", "package 'nope' not found", "ERROR: no workspace: "
    assert any(reason in done.stderr for reason in reasons)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_roscd_alone_goes_to_the_workspace(network: Network, shell: str) -> None:
    below = network.folder / "ws" / "src" / "demo" / "msg"
    below.mkdir(parents=True)
    done = evaluate(network, shell, f"cd {below}", "roscd", "pwd")
    assert (done.stdout, done.stderr) == (f"{network.folder}/ws\n", "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_roscd_goes_to_a_package(network: Network, shell: str) -> None:
    folder = network.folder / "src" / "demo"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>demo</name></package>")
    done = evaluate(network, shell, "roscd demo", "pwd")
    assert (done.stdout, done.stderr) == (f"{folder}\n", "")


def test_rosed_opens_the_file(network: Network) -> None:
    done = evaluate(network, "bash", "EDITOR=cat rosed std_msgs Bool.msg")
    assert "bool data" in done.stdout
    assert evaluate(network, "bash", "rosed std_msgs Nope.msg").returncode == 1


def test_the_shell_is_guessed(shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHELL", "/usr/bin/fish")
    assert shell("env").out == shell("env", "fish").out
    monkeypatch.setenv("SHELL", "/bin/dash")
    assert shell("env").out == shell("env", "bash").out


def test_an_unknown_shell(shell: Shell) -> None:
    result = shell("env", "fsh")
    assert result.code == 2
    assert "'fsh' is not a known shell; expected bash, zsh, fish; did you mean 'fish'?" in (
        result.err
    )


def test_the_settings(shell: Shell) -> None:
    assert shell("env", "--json").json["domain"] == 42


def test_modules_of_the_working_folder_do_not_shadow_others(network: Network) -> None:
    (network.folder / "typing.py").write_text("raise SystemExit('the wrong module')")
    done = evaluate(network, "bash", "rosmsg show std_msgs/Bool")
    assert (done.stdout, done.stderr) == ("bool data\n\n", "")
