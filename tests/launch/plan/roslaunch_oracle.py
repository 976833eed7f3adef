"""The same questions to real roslaunch, if it is installed, and to rosz."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from oracle import Worker, require

from rosz import names
from rosz.errors import RoszError
from rosz.launch.plan import (
    NodePlan,
    Plan,
    SystemContext,
    describe_args,
    parse_arguments,
    plan,
)
from rosz.launch.run import report
from rosz.packages import PackageIndex


class Roslaunch(Worker):
    """Real roslaunch in one long-lived process.

    Args:
        environ: Its environment, by `environment`.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        require("roslaunch", package="python3-roslaunch")
        super().__init__("roslaunch_calls", environ)

    def ask(
        self,
        files: Sequence[str],
        cwd: Path,
        argv: Sequence[str] = (),
        environ: Mapping[str, str] | None = None,
    ) -> dict[str, Any]:
        """Return what roslaunch makes of some files."""
        question = {
            "files": list(files),
            "argv": list(argv),
            "cwd": str(cwd),
            "environ": dict(environ or {}),
            "unset": ["ROS_NAMESPACE", "ROSZ_TEST"],
        }
        found: dict[str, Any] = self.call("load", question)
        return found


def environment(packages: Path, home: Path) -> dict[str, str]:
    """Return the environment that both read launch files in."""
    return {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "ROS_HOME": str(home),
        "ROS_IP": "127.0.0.1",
        "ROS_MASTER_URI": "http://127.0.0.1:1",
        "ROS_PACKAGE_PATH": str(packages),
    }


class Rosz:
    """The same questions to rosz.

    Args:
        environ: The environment, by `environment`.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        self._index = PackageIndex(list(map(Path, environ["ROS_PACKAGE_PATH"].split(":"))))
        self._environ = environ

    def context(self, cwd: Path, environ: Mapping[str, str] | None = None) -> SystemContext:
        """Return a context that numbers anonymous names."""
        counts: Counter[str] = Counter()

        def anonymous(base: str) -> str:
            counts[base] += 1
            return f"{base}_anonymous_{counts[base]}"

        return SystemContext(self._index, {**self._environ, **(environ or {})}, cwd, anonymous)

    def plan(
        self,
        files: Sequence[str],
        cwd: Path,
        argv: Sequence[str] = (),
        environ: Mapping[str, str] | None = None,
    ) -> Plan:
        """Return the plan of some files."""
        given = parse_arguments(argv)
        ns = given.ns or (environ or {}).get("ROS_NAMESPACE", "")
        return plan(files, given.args, self.context(cwd, environ), ns=ns)

    def ask(
        self,
        files: Sequence[str],
        cwd: Path,
        argv: Sequence[str] = (),
        environ: Mapping[str, str] | None = None,
    ) -> dict[str, Any]:
        """Return what rosz makes of some files, in the form of `Roslaunch.ask`."""
        given = parse_arguments(argv)
        try:
            found = self.plan(files, cwd, argv, environ)
        except RoszError as error:
            return {"error": str(error)}
        ns = given.ns or (environ or {}).get("ROS_NAMESPACE", "/")
        context = self.context(cwd, environ)
        named = [node.full_name for node in found.nodes if node.named]
        return {
            "error": None,
            "params": [[param.name, repr(param.value)] for param in found.params],
            "nodes": [_process(node) for node in found.nodes],
            "tests": [
                {
                    **_process(test.node),
                    "test_name": test.test_name,
                    "limit": test.time_limit,
                    "retry": test.retry,
                }
                for test in found.tests
            ],
            "clear": list(found.clear),
            "setup": [_setup(s.action, s.file, s.name) for s in found.setup],
            "machines": sorted(
                [
                    *(m.name, m.address, m.ssh_port, m.user or None, m.password or None),
                    *(m.timeout, m.assignable),
                ]
                for m in found.machines
            ),
            "complaints": [str(notice) for notice in (*found.warnings, *found.deprecations)],
            "dump": report.dump_params(found) + "\n",
            "node_list": report.list_nodes(found) + "\n",
            "file_list": report.list_files(found) + "\n",
            "ros_args": self._ros_args(files, given.args, context, ns),
            "args": {name: self._args(found, name, environ or {}) for name in named},
            "places": {name: _place(found, name) for name in named},
        }

    def _ros_args(
        self, files: Sequence[str], args: Mapping[str, str], context: SystemContext, ns: str
    ) -> str:
        return report.describe(describe_args(files, args, context, ns=ns)) + "\n"

    def _args(self, found: Plan, name: str, environ: Mapping[str, str]) -> str | None:
        def find(package: str, type_name: str) -> str:
            return str(self._index.find(package).executable(type_name))

        try:
            return report.node_args(found, name, find, {**self._environ, **environ}) + "\n"
        except RoszError:
            return None


def _place(found: Plan, name: str) -> str | None:
    try:
        return report.node_file(found, name) + "\n"
    except RoszError:
        return None


def _process(node: NodePlan) -> dict[str, Any]:
    return {
        "package": node.package,
        "type": node.type,
        "name": node.name if node.named else None,
        "namespace": node.namespace,
        "machine": node.machine,
        "respawn": node.respawn,
        "respawn_delay": node.respawn_delay,
        "required": node.required,
        "output": node.output,
        "cwd": node.cwd or None,
        "remaps": [list(pair) for pair in node.remaps],
        "env": [list(pair) for pair in node.env],
        "file": node.place.file,
    }


def _setup(action: str, file: str, name: str) -> list[str]:
    return ["rosparam", action, *([file] if file else []), name]


def differences(ours: Mapping[str, Any], real: Mapping[str, Any]) -> list[str]:
    """Return the differences between rosz and roslaunch, in words."""
    if ours["error"] is not None or real["error"] is not None:
        if ours["error"] is not None and real["error"] is not None:
            return []
        return [f"error: rosz {ours['error']!r}, roslaunch {real['error']!r}"]
    pairs = ((key, *_comparable(key, ours[key], wanted)) for key, wanted in real.items())
    return [f"{key}: rosz {a!r}, roslaunch {b!r}" for key, a, b in pairs if a != b]


def _comparable(key: str, ours: Any, real: Any) -> tuple[Any, Any]:
    """Bring two reports into a form in which they must be equal."""
    if key in {"ros_args", "dump"} and real is None:
        # roslaunch stumbles over binary values, and over args that are not given
        ours = None
    elif key == "dump" and "&id" in real:
        # PyYAML writes aliases wherever two parameters came from one anchor
        ours, real = yaml.safe_load(ours), yaml.safe_load(real)
    elif key == "complaints":
        ours, real = bool(ours), bool(ours or real)  # rosz warns about more
    elif key == "file_list":
        ours, real = sorted(ours.split()), sorted(set(real.split()))
    elif key == "clear":
        real = [names.canonical(name) for name in real]
    elif key == "setup":
        # a private name there is private to the rosparam that roslaunch runs
        last = [words[-1].replace("~", "/rosparam/", 1) for words in real]
        real = [
            [*words[:-1], names.canonical(name)] for words, name in zip(real, last, strict=True)
        ]
    return ours, real
