"""The two sides: Debian's ROS 1, and rosz."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import msgspec

from rosz.environment import Environment, package_index
from rosz.launch.plan import SystemContext, plan
from rosz.launch.run import Workplace

__all__ = ("Outcome", "Ros", "Rosz", "Side", "package_of")

Outcome = tuple[str, str]
"""``passed``, ``failed`` or ``skipped``, and the traceback."""

_UNIT = Path(__file__).with_name("unit.py")
_SYSTEM = "/usr/bin/python3"
_DEBIAN = Path("/usr/lib/python3/dist-packages")
_REPOSITORY = Path(__file__).parents[2]
_ENDING_SECONDS = 10


class Side:
    """Base class of the two sides.

    Args:
        roots: Folders of packages.
        folder: Folder for files of the run.
        seconds: Time limit for one file.
    """

    name = ""

    def __init__(self, roots: Sequence[Path], folder: Path, seconds: float) -> None:
        self.roots = roots
        self.folder = folder
        self.seconds = seconds
        folder.mkdir(parents=True, exist_ok=True)

    def run(self, file: Path) -> dict[str, Outcome]:
        """Run the tests of a file, and return their outcomes by name."""
        return self.run_launch(file) if file.suffix == ".test" else self.run_unit(file)

    def run_unit(self, file: Path) -> dict[str, Outcome]:
        """Run a Python file with a core beside it."""
        raise NotImplementedError

    def run_launch(self, file: Path) -> dict[str, Outcome]:
        """Run a launch file with tests."""
        raise NotImplementedError

    def _unit(self, command: Sequence[str], file: Path, environ: Mapping[str, str]) -> Any:
        results = self.folder / "unit.json"
        results.unlink(missing_ok=True)
        words = [*command, str(_UNIT), str(file), str(results)]
        log = self.folder / f"{file.stem}.log"
        code = execute(words, environ, package_of(file), self.seconds, log)
        lines = results.read_text().splitlines() if results.exists() else []
        found = {name: (outcome, text) for name, outcome, text in map(json.loads, lines)}
        if not found or code:
            text = log.read_text(errors="replace")
            found[f"{file.stem} (whole file)"] = ("failed", f"{text}\nexit code {code}")
        return found


class Ros(Side):
    """Debian's ROS 1."""

    name = "ROS 1"

    def __init__(self, roots: Sequence[Path], folder: Path, seconds: float) -> None:
        super().__init__(roots, folder, seconds)
        self._port = _free_port()
        python = folder / "python"
        self._environ = {
            "PATH": f"{_wrappers(folder)}:/usr/bin:/bin:/usr/sbin:/sbin",
            "HOME": str(folder),
            "ROS_HOME": str(folder / "home"),
            "ROS_IP": "127.0.0.1",
            "ROS_MASTER_URI": f"http://127.0.0.1:{self._port}",
            "ROS_PACKAGE_PATH": ":".join([*map(str, roots), "/usr/share"]),
            "ROS_ROOT": "/usr/share/ros",
            "ROS_DISTRO": "noetic",
            "PYTHONPATH": str(python),
            "LANG": "C.UTF-8",
        }
        offer(roots, python)

    def run_unit(self, file: Path) -> dict[str, Outcome]:
        """Run a Python file with Debian's interpreter, and a roscore beside it."""
        core = _start(["/usr/bin/roscore", "-p", str(self._port)], self._environ)
        try:
            _wait_for_port(self._port)
            found: dict[str, Outcome] = self._unit([_SYSTEM], file, self._environ)
            return found
        finally:
            _end(core)

    def run_launch(self, file: Path) -> dict[str, Outcome]:
        """Run a launch file with rostest, which starts a core of its own."""
        results = self.folder / "results"
        shutil.rmtree(results, ignore_errors=True)
        log = self.folder / f"{file.stem}.log"
        command = ["/usr/bin/rostest", "--results-base-dir", str(results), str(file)]
        environ = self._environ | {"ROS_TEST_RESULTS_DIR": str(results)}
        execute(command, environ, package_of(file), self.seconds, log)
        found: dict[str, Outcome] = {}
        for path in sorted(results.rglob("*.xml")):
            if not path.name.startswith("rostest-"):  # the summary of the file
                found |= read_results(path)
        return found or {f"{file.stem} (whole file)": ("failed", log.read_text(errors="replace"))}


class Rosz(Side):
    """The rosz of this checkout."""

    name = "rosz"

    def __init__(self, roots: Sequence[Path], folder: Path, seconds: float) -> None:
        super().__init__(roots, folder, seconds)
        self._sockets = Path(tempfile.mkdtemp(prefix="peers", dir="/tmp"))
        bin_folder = _REPOSITORY / "rosz" / "cli" / "bin"
        own = Path(sys.executable).parent
        self._environ = {
            "ROS_ROOT": "/usr/share/ros",
            "PATH": f"{bin_folder}:{own}:/usr/bin:/bin:/usr/sbin:/sbin",
            "HOME": str(folder),
            "ROS_HOME": str(folder / "home"),
            "ROSZ_PYTHON": sys.executable,
            "ROSZ_RENDEZVOUS": f"unixsock-stream/{self._sockets}/z",
            "ROS_DOMAIN_ID": str(60 + os.getpid() % 100),
            "ROSZ_PACKAGE_PATH": ":".join(map(str, roots)),
            "ROS_PACKAGE_PATH": ":".join(map(str, roots)),
            "PYTHONPATH": f"{_REPOSITORY / 'rosz' / 'ros1' / 'shell'}",
            "LANG": "C.UTF-8",
        }

    def close(self) -> None:
        """Remove the folder of sockets."""
        shutil.rmtree(self._sockets, ignore_errors=True)

    def run_unit(self, file: Path) -> dict[str, Outcome]:
        """Run a Python file with a core of rosz beside it."""
        core = self._core()
        try:
            command = [sys.executable, "-P", "-m", "rosz.ros1"]
            found: dict[str, Outcome] = self._unit(command, file, self._environ)
            return found
        finally:
            _end(core)

    def run_launch(self, file: Path) -> dict[str, Outcome]:
        """Run each test of a launch file with a core and nodes of its own, as rostest does."""
        environ = {**os.environ, **self._environ}
        environment = Environment.read(environ, package_of(file))
        packages = package_index(environment)
        whole = plan([str(file)], {}, SystemContext(packages, environ, Path.cwd(), _names()))
        place = Workplace(packages, environment, self._environ, str(package_of(file)))
        log = self.folder / f"{file.stem}.log"
        found: dict[str, Outcome] = {}
        for test in whole.tests:
            with self._launched(file, log, len(whole.nodes)):
                found |= self._test(place, test, log)
        return found

    @contextmanager
    def _launched(self, file: Path, log: Path, nodes: int) -> Iterator[None]:
        core = self._core()
        try:
            with log.open("w") as out:
                command = [sys.executable, "-P", "-m", "rosz", "launch", "-v", str(file)]
                launch = _start(command, self._environ, out)
                try:
                    self._wait_for_nodes(launch, log, nodes)
                    yield
                finally:
                    _end(launch)
        finally:
            _end(core)

    def _test(self, place: Workplace, test: Any, log: Path) -> dict[str, Outcome]:
        result = self.folder / f"{test.test_name}.xml"
        result.unlink(missing_ok=True)
        option = f"--gtest_output=xml:{result}"
        node = msgspec.structs.replace(test.node, args=(*test.node.args, option))
        own = log.with_name(f"{log.stem}-{test.test_name}.log")
        try:
            command = place.command(node, log_file=None, tag="peers")
        except Exception as error:  # noqa: BLE001  # one test of several cannot start
            return {test.test_name: ("failed", f"{error}")}
        limit = min(test.time_limit, self.seconds)
        cwd = Path(command.cwd)
        cwd.mkdir(parents=True, exist_ok=True)
        code = execute(command.argv, command.environ, cwd, limit, own)
        if result.exists():
            return read_results(result)
        text = own.read_text(errors="replace")
        return {test.test_name: ("failed", f"{text}\nno results, exit code {code}")}

    def _core(self) -> Any:
        shutil.rmtree(self._sockets, ignore_errors=True)
        self._sockets.mkdir()
        with (self.folder / "core.log").open("w") as out:
            core = _start([sys.executable, "-P", "-m", "rosz", "core"], self._environ, out)
        _wait_until(lambda: "press Ctrl-C" in (self.folder / "core.log").read_text(), core)
        return core

    @staticmethod
    def _wait_for_nodes(launch: subprocess.Popen[bytes], log: Path, count: int) -> None:
        _wait_until(lambda: log.read_text().count("started with pid") >= count > 0, launch)


def read_results(path: Path) -> dict[str, Outcome]:
    """Return the outcomes in a file of results."""
    found: dict[str, Outcome] = {}
    text = path.read_text(errors="replace")
    if not text.strip():  # the test was killed
        return {f"{path.stem} (whole file)": ("failed", "no results")}
    for case in ET.fromstring(text).iter("testcase"):
        name = f"{case.get('classname', '').rpartition('.')[2]}.{case.get('name')}"
        bad = [child for child in case if child.tag in ("failure", "error")]
        text = "\n".join(child.text or child.get("message") or "" for child in bad)
        skipped = case.find("skipped") is not None
        found[name] = ("failed" if bad else "skipped" if skipped else "passed", text)
    return found


def package_of(file: Path) -> Path:
    """Return the folder of the package of a file, or the folder of the file."""
    return next((up for up in file.parents if (up / "package.xml").exists()), file.parent)


def execute(
    command: Sequence[str], environ: Mapping[str, str], cwd: Path, seconds: float, log: Path
) -> int | None:
    """Run a command in a process group of its own, which ends with it or at the time limit."""
    with log.open("w") as out:
        process = subprocess.Popen(
            list(command),
            env=dict(environ),
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            return process.wait(seconds)
        except subprocess.TimeoutExpired:
            out.write(f"not within {seconds:g} s\n")
            return None
        finally:
            _end(process)


def offer(roots: Sequence[Path], target: Path) -> None:
    """Make the messages and modules of packages importable for Debian's Python, as catkin does.

    What Debian has itself is left out.
    """
    target.mkdir(parents=True, exist_ok=True)
    packages = {folder.name: folder for root in roots for folder in _packages(root)}
    include = [f"-I{path.parent.name}:{path}" for path in Path("/usr/share").glob("*/msg")]
    actions = {name: path for name, path in packages.items() if (path / "action").is_dir()}
    for name, path in actions.items():
        _generate_actions(path, target.parent / "actions" / name)
    for name, path in packages.items():
        include += [f"-I{name}:{path / 'msg'}"] * (path / "msg").is_dir()
        include += [f"-I{name}:{target.parent / 'actions' / name}"] * (name in actions)
    for name, path in packages.items():
        if (_DEBIAN / name).exists() or (target / name).exists():
            continue
        _generate(name, path, target, include)
        for source in sorted((path / "src").glob("*")) if (path / "setup.py").exists() else ():
            _link(source, target)


def _link(source: Path, target: Path) -> None:
    if (_DEBIAN / source.name).exists():
        return
    if source.suffix == ".py":
        (target / source.name).symlink_to(source)
    elif (source / "__init__.py").exists():
        (target / source.name).mkdir(exist_ok=True)
        for child in source.iterdir():
            link = target / source.name / child.name
            if child.name == "__init__.py":
                link.unlink(missing_ok=True)
            if not link.exists():
                link.symlink_to(child)


def _generate(name: str, path: Path, target: Path, include: Sequence[str]) -> None:
    for kind in ("msg", "srv"):
        files = sorted((path / kind).glob(f"*.{kind}"))
        if kind == "msg":
            files += sorted((target.parent / "actions" / name).glob("*.msg"))
        if not files:
            continue
        folder = target / name / kind
        folder.mkdir(parents=True, exist_ok=True)
        generator = f"/usr/lib/genpy/gen{kind}_py.py"
        options = ["-p", name, "-o", str(folder)]
        command = [_SYSTEM, generator, *options]
        if subprocess.run([*command, *map(str, files), *include], check=False).returncode:
            for file in files:  # one bad definition stops the others
                subprocess.run([*command, str(file), *include], check=False)
        subprocess.run([_SYSTEM, generator, *options, "--initpy"], check=True)
        (target / name / "__init__.py").touch()


def _generate_actions(path: Path, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for file in sorted((path / "action").glob("*.action")):
        command = [_SYSTEM, "/usr/lib/actionlib_msgs/genaction.py", str(file), "-o", str(folder)]
        subprocess.run(command, check=True)


def _packages(root: Path) -> Iterator[Path]:
    if (root / "package.xml").exists():
        yield root
        return
    for path in sorted(root.rglob("package.xml")):
        if not any((up / "CATKIN_IGNORE").exists() for up in path.parents):
            yield path.parent


def _wrappers(folder: Path) -> Path:
    """Return a folder with ``python``, which Debian lacks and old scripts name."""
    target = folder / "bin"
    target.mkdir(parents=True, exist_ok=True)
    if not (target / "python").is_symlink():
        (target / "python").symlink_to(_SYSTEM)
    return target


def _names() -> Any:
    from itertools import count

    counter = count()
    return lambda name: f"{name}_peers_{next(counter)}"


def _free_port() -> int:
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _start(command: Sequence[str], environ: Mapping[str, str], out: Any = None) -> Any:
    out = subprocess.DEVNULL if out is None else out
    return subprocess.Popen(
        list(command),
        env=dict(environ),
        stdin=subprocess.DEVNULL,
        stdout=out,
        stderr=out,
        start_new_session=True,
    )


def _end(process: Any) -> None:
    """End a process and its group."""
    for number in (signal.SIGINT, signal.SIGKILL):
        try:
            os.killpg(process.pid, number)
        except ProcessLookupError:
            break
        try:
            process.wait(_ENDING_SECONDS)
        except subprocess.TimeoutExpired:
            continue
    process.wait()


def _wait_until(condition: Any, process: Any) -> None:
    import time

    deadline = time.monotonic() + 30
    while not condition() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)


def _wait_for_port(port: int) -> None:
    import socket
    import time

    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
