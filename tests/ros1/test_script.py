"""A script under ``python -m rosz.ros1`` behaves as under the interpreter, also on Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from network import Network

ROOT = Path(__file__).parents[2]


def run(
    folder: Path, script: str | bytes, *args: str, safe: bool = True, name: str = "node.py"
) -> subprocess.CompletedProcess[str]:
    path = folder / name
    path.write_bytes(script if isinstance(script, bytes) else script.encode())
    return subprocess.run(
        [sys.executable, *(["-P"] if safe else []), "-m", "rosz.ros1", str(path), *args],
        capture_output=True,
        text=True,
        cwd=folder,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT), "HOME": str(folder)},
        timeout=300,
        check=False,
    )


def plain(folder: Path, *args: str, name: str = "node.py") -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(folder / name), *args],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=300,
        check=False,
    )


SAME: dict[str, str | bytes] = {
    "what it knows of itself": """
import sys
print(sys.argv, sys.path[0], __name__, __file__, __spec__, __package__, __doc__)
print(sys.modules['__main__'].__dict__ is globals(), __builtins__, __loader__.path)
print(sorted(globals()))
""",
    "a docstring": "'''doc'''\nprint(__doc__)\n",
    "a return code": "import sys\nsys.exit(7)\n",
    "a return text": "import sys\nsys.exit('no more')\n",
    "an exception": "def f(x):\n    return 1 / x\n\nf(0)\n",
    "a chain of exceptions": (
        "try:\n    1 / 0\nexcept ZeroDivisionError as e:\n    raise KeyError('x') from e\n"
    ),
    "an exception of its own": "class Odd(Exception): pass\nraise Odd('so')\n",
    "a hook of its own": (
        "import sys\nsys.excepthook = lambda k, e, t: print('hook', k, e, t.tb_lineno)\n1 / 0\n"
    ),
    "an end by signal": "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n",
    "an interrupt": "raise KeyboardInterrupt\n",
    "atexit": "import atexit\nx = 5\natexit.register(lambda: print('bye', x))\n",
    "a module beside it": "import neighbour\nprint(neighbour.__file__)\n",
    "pickling": (
        "import pickle\nclass A:\n    def __eq__(self, o): return True\n"
        "print(pickle.loads(pickle.dumps(A())) == A(), pickle.dumps(A())[:40])\n"
    ),
    "multiprocessing": (
        "import multiprocessing as m\n\ndef f(x): return x * x\n\n"
        "if __name__ == '__main__':\n    with m.get_context('spawn').Pool(1) as p:\n"
        "        print(p.map(f, [1, 2, 3]))\n"
    ),
    "dataclasses": (
        "from __future__ import annotations\nimport dataclasses, typing\n\n@dataclasses.dataclass\n"
        "class P:\n    x: int\n\nprint(P(1), typing.get_type_hints(P))\n"
    ),
    "a syntax error": "x = (1,\n",
    "another encoding": "# -*- coding: latin-1 -*-\nprint(ascii('\xe9'))\n".encode("latin-1"),
    "no future of ours": "def f(x: undefined_name): pass\n",
}


@pytest.mark.parametrize("what", SAME)
def test_script_runs_as_by_the_interpreter(tmp_path: Path, what: str) -> None:
    (tmp_path / "neighbour.py").write_text("")
    ours = run(tmp_path, SAME[what], "a", "b:=c", "-x")
    expected = plain(tmp_path, "a", "b:=c", "-x")
    assert (ours.returncode, ours.stdout, ours.stderr) == (
        expected.returncode,
        expected.stdout,
        expected.stderr,
    )


def test_links_are_followed_to_the_folder(tmp_path: Path) -> None:
    real = tmp_path / "real"
    real.mkdir()
    (real / "node.py").write_text("import sys\nprint(sys.path[0], sys.argv[0])\n")
    (tmp_path / "link").symlink_to(real / "node.py")
    script = (real / "node.py").read_text()
    ours = run(tmp_path, script, name="link")
    assert ours.stdout == plain(tmp_path, name="link").stdout


def test_without_safe_path_the_working_folder_is_not_searched(tmp_path: Path) -> None:
    assert str(tmp_path) in run(tmp_path, "import sys; print(sys.path)", safe=True).stdout
    shown = run(tmp_path, "import sys; print(sys.path[0])", safe=False)
    assert shown.stdout == f"{tmp_path}\n"


def test_ros_names_can_be_imported(tmp_path: Path) -> None:
    done = run(tmp_path, "from std_msgs.msg import String\nprint(String(data='x').data)\n")
    assert (done.returncode, done.stdout, done.stderr) == (0, "x\n", "")


PYTHON_2 = {
    'import sys\nprint "hello"\n': ":2:1: this is Python 2 (print without parentheses); convert",
    "print x\n": ":1:1: this is Python 2 (print without parentheses); convert",
    "try:\n  pass\nexcept OSError, e:\n  pass\n": ":3:8: this is Python 2 ('except Error, name')",
    "raise ValueError, 'x'\n": ":1:17: this is Python 2 ('raise Error, text'); convert",
    "x = 0777\n": ":1:5: this is Python 2 (an octal number such as 0777); convert",
    "x = 10L\n": ":1:6: this is Python 2 (a long number such as 10L); convert",
    "x = `1`\n": ":1:5: this is Python 2 (backticks for repr()); convert",
    "x = 1 <> 2\n": ":1:7: this is Python 2 ('<>' for '!='); convert",
    "x = ur'a'\n": ":1:7: this is Python 2 (a text such as ur''); convert",
    "def f(a, (b, c)): pass\n": ":1:10: this is Python 2 (a tuple among the parameters); convert",
    "exec 'x'\n": ":1:1: this is Python 2 (exec without parentheses); convert",
}


@pytest.mark.parametrize("script", PYTHON_2)
def test_python_2_syntax_is_explained_in_one_line(tmp_path: Path, script: str) -> None:
    done = run(tmp_path, script)
    path = tmp_path / "node.py"
    assert done.stderr.startswith(f"ERROR: {path}{PYTHON_2[script]}")
    assert done.stderr.endswith(f"with: 2to3 -w {path} (or futurize -w {path})\n")
    assert done.stderr.count("\n") == 1
    assert done.returncode == 1


def test_mixed_tabs_and_spaces_are_explained_in_one_line(tmp_path: Path) -> None:
    done = run(tmp_path, "def f():\n\tif 1:\n        return 2\n")
    assert done.stderr == (
        f"ERROR: {tmp_path}/node.py:3:1: indented by tabs and spaces in turn, as Python 2 allowed;"
        f" write 8 columns for each tab with: expand -i -t 8 {tmp_path}/node.py\n"
    )
    assert done.returncode == 1


HINTS = {
    "raw_input()\n": "'raw_input' is Python 2; Python 3 has 'input'",
    "import Queue\n": "module 'Queue' is Python 2; Python 3 has 'queue'",
    "{}.iteritems()\n": "'iteritems' is Python 2; Python 3 has items()",
    "{}.has_key(1)\n": "'has_key' is Python 2; Python 3 has 'key in dict'",
}


@pytest.mark.parametrize("script", HINTS)
def test_python_2_names_are_explained_after_the_traceback(tmp_path: Path, script: str) -> None:
    done = run(tmp_path, script)
    expected = plain(tmp_path)
    assert done.stderr == f"{expected.stderr}ERROR: {HINTS[script]}\n"
    assert done.returncode == 1


@pytest.mark.parametrize(
    ("script", "advice"),
    [
        (
            "import cv2, numpy\ncv2.imshow('camera', numpy.zeros((2, 2)))\n",
            "pip uninstall -y opencv-python-headless && pip install 'rosz[vision]'",
        ),
        (
            "import broken_cv2\n",
            "pip uninstall -y opencv-python && pip install 'rosz[vision-headless]'",
        ),
    ],
    ids=["no windows", "no display"],
)
def test_an_opencv_for_another_machine_is_explained(
    tmp_path: Path, script: str, advice: str
) -> None:
    pytest.importorskip("cv2")
    text = "raise ImportError('libGL.so.1: cannot open shared object file')\n"
    (tmp_path / "broken_cv2.py").write_text(text)
    done = run(tmp_path, script)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("ERROR: opencv-python")
    assert done.stderr.endswith(f"; run: {advice}\n")


@pytest.mark.parametrize("name", ["print_input", "xrange2"])
def test_other_names_are_not_explained(tmp_path: Path, name: str) -> None:
    assert "ERROR:" not in run(tmp_path, f"{name}()\n").stderr


def test_usage_errors(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-m", "rosz.ros1"]
    environ = {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, env=environ, timeout=300, check=False)
    assert (done.returncode, done.stderr[:6]) == (2, b"usage:")
    gone = str(tmp_path / "gone.py")
    done = subprocess.run(
        [*command, gone], capture_output=True, env=environ, timeout=300, check=False
    )
    assert done.returncode == 1
    assert done.stderr.decode() == f"ERROR: cannot run '{gone}': No such file or directory\n"


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("import rosz; rosz.Node('a b')", "'a b' is not a valid name: character ' ' at position 2"),
        ("from rosz.errors import ParamNotFound; raise ParamNotFound('/x')", "'/x' is not set"),
    ],
)
def test_errors_of_rosz_are_one_line_with_a_place(tmp_path: Path, line: str, text: str) -> None:
    done = run(tmp_path, f"\n{line}\n")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"ERROR: {tmp_path}/node.py:2: ")
    assert text in done.stderr


# A signal right before one long sleep would be seen at its end.
SLOW = "import os, sys, time\nos.write(1, b'loading\\n')\nwhile True: time.sleep(0.01)\n"


@pytest.mark.parametrize("module", ["rosz.script", "rosz.ros1"])
def test_ctrl_c_during_imports(network: Network, module: str) -> None:
    (network.folder / "slow.py").write_text(SLOW)
    script = network.folder / "script.py"
    script.write_text("import slow\n")
    program = network.run("-P", "-m", module, str(script))
    program.wait_for("loading")
    program.send(signal.SIGINT)
    assert program.exit_code() == -signal.SIGINT
    assert program.output == "loading"


def test_ctrl_c_while_rosz_loads(network: Network) -> None:
    # The folder comes before that of the real msgspec on the path.
    (network.folder / "msgspec.py").write_text(SLOW)
    script = network.folder / "script.py"
    script.write_text("print('begun')\n")
    path = f"{network.folder}:{ROOT}"
    program = network.run("-P", "-m", "rosz.script", str(script), PYTHONPATH=path)
    program.wait_for("loading")
    program.send(signal.SIGINT)
    assert program.exit_code() == -signal.SIGINT
    assert program.output == "loading"


@pytest.mark.parametrize("module", ["rosz.script", "rosz.ros1"])
def test_a_running_script_catches_ctrl_c(network: Network, module: str) -> None:
    script = network.folder / "script.py"
    script.write_text(
        "import time\n"
        "try:\n"
        "    print('begun', flush=True)\n"
        "    while True: time.sleep(0.01)\n"
        "except KeyboardInterrupt:\n"
        "    print('caught')\n"
    )
    program = network.run("-P", "-m", module, str(script))
    program.wait_for("begun")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert program.lines == ["begun", "caught"]
