"""Launches on a thread of the test, with a network in memory and a console to wait on."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from rosz.environment import Environment
from rosz.errors import ParamNotFound
from rosz.launch.plan.model import Condition, NodePlan, ParamPlan, Place, Plan, SetupPlan
from rosz.launch.run import Network, Options, Runner, Workplace
from rosz.packages import PackageIndex
from rosz.session import Session

TIMEOUT = 60.0
"""Time limit in seconds for something that normally takes milliseconds."""

HERE = Place("test.launch", 3, 5)


class MemoryNetwork(Network):
    """Parameters in a flat dictionary, and conditions that a test makes true.

    Args:
        session: Session that replies to requests, or None.
        domain: ROS domain.
        **values: Parameters.

    Attributes:
        values: Parameters by name.
        batches: All writes: values and deleted names.
        true: Conditions that are true.
    """

    def __init__(self, session: Session | None = None, domain: int = 0, **values: Any) -> None:
        self.session = session
        self.domain = domain
        self.alone = True
        self.router = None
        self.values: dict[str, Any] = {f"/{name}": value for name, value in values.items()}
        self.batches: list[tuple[dict[str, Any], list[str]]] = []
        self.true: set[str] = set()

    def get(self, name: str) -> Any:
        if name not in self.values:
            raise ParamNotFound(name)
        return self.values[name]

    def has(self, name: str) -> bool:
        return name in self.values

    def write(self, values: Mapping[str, Any], deleted: Iterable[str] = ()) -> None:
        gone = list(deleted)
        self.batches.append((dict(values), gone))
        for name in gone:
            for key in [k for k in self.values if k == name or k.startswith(f"{name}/")]:
                del self.values[key]
        self.values.update(values)

    def dump(self, name: str) -> str:
        return f"{self.get(name)}\n"

    def holds(self, condition: Condition) -> bool:
        return str(condition) in self.true


class Transcript(io.StringIO):
    """A stream whose lines can be waited for."""

    def __init__(self) -> None:
        super().__init__()
        self._changed = threading.Condition()

    def write(self, text: str) -> int:
        with self._changed:
            count = super().write(text)
            self._changed.notify_all()
        return count

    def wait_for(self, text: str, times: int = 1) -> str:
        with self._changed:
            found = self._changed.wait_for(lambda: self.getvalue().count(text) >= times, TIMEOUT)
            assert found, f"no {text!r} ({times} times) in:\n{self.getvalue()}"
            return self.getvalue()


def alive(pid: int) -> bool:
    """Return whether a process runs; one that has ended and was not reaped does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):  # gone before, or between opening and reading
        return False
    return state != "Z"


def program(name: str, *words: str, **settings: Any) -> NodePlan:
    """Return the plan of a process that is not a ROS node."""
    defaults: dict[str, Any] = {
        "package": "",
        "type": "",
        "name": name,
        "namespace": "/",
        "place": HERE,
        "cwd": "/",
    }
    return NodePlan(command=words, **{**defaults, **settings})


def shell(name: str, script: str, **settings: Any) -> NodePlan:
    """Return the plan of a shell script."""
    return program(name, "sh", "-c", script, **settings)


def param(name: str, value: Any) -> ParamPlan:
    return ParamPlan(name, value, HERE)


def setup(action: Any, name: str, file: str = "") -> SetupPlan:
    return SetupPlan(action, name, file, HERE)


class Launch:
    """A runner on a thread of its own."""

    def __init__(
        self,
        folder: Path,
        plan: Plan,
        *,
        network: Network | None = None,
        packages: PackageIndex | None = None,
        environ: Mapping[str, str] | None = None,
        **options: Any,
    ) -> None:
        self.out = Transcript()
        self.err = Transcript()
        self.code: int | None = None
        self.raised: BaseException | None = None
        variables = dict(os.environ if environ is None else environ)
        environment = Environment(home=folder / "home", log_dir=folder / "log", package_roots=())
        workplace = Workplace(packages or PackageIndex([]), environment, variables, str(folder))
        self.runner = Runner(
            plan,
            workplace,
            network or MemoryNetwork(),
            Options(**options),
            out=self.out,
            err=self.err,
        )
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            self.code = self.runner.run()
        except BaseException as error:  # noqa: BLE001  # handed to the test
            self.raised = error

    def stop(self) -> int:
        """End the launch, and return its exit code."""
        self.runner.stop()
        return self.join()

    def join(self) -> int:
        """Wait for the launch to end by itself, and return its exit code."""
        self._thread.join(TIMEOUT)
        assert not self._thread.is_alive(), self.out.getvalue() + self.err.getvalue()
        if self.raised is not None:
            raise self.raised
        assert self.code is not None
        return self.code

    def pid(self, label: str, times: int = 1) -> int:
        """Return the process id of the latest start of a process, after ``times`` starts."""
        start = f"process[{label}]: started with pid ["
        text = self.out.wait_for(start, times)
        return int(text.split(start)[times].partition("]")[0])


@contextmanager
def launch(
    folder: Path, *nodes: NodePlan, plan: Plan | None = None, **rest: Any
) -> Iterator[Launch]:
    """Run a launch while the block runs, and check that it ends."""
    base = plan or Plan()
    running = Launch(folder, msgspec.structs.replace(base, nodes=(*base.nodes, *nodes)), **rest)
    try:
        yield running
    finally:
        running.runner.stop()
        running._thread.join(TIMEOUT)
        assert not running._thread.is_alive()
