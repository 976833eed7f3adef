"""What tests of the runner share: a store in memory, a console to wait on, launches in a thread."""

from __future__ import annotations

import io
import os
import threading
import time
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

PATIENCE = 20.0
"""Seconds after which a test gives up on something that normally takes milliseconds."""

HERE = Place("test.launch", 3, 5)


class MemoryStore:
    """Parameters in a dictionary, flat, with a record of what was asked."""

    def __init__(self, **values: Any) -> None:
        self.values: dict[str, Any] = {f"/{name}": value for name, value in values.items()}
        self.batches: list[tuple[dict[str, Any], list[str]]] = []

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


class Facts:
    """Conditions that a test makes true."""

    def __init__(self) -> None:
        self.true: set[str] = set()

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
            found = self._changed.wait_for(lambda: self.getvalue().count(text) >= times, PATIENCE)
            assert found, f"no {text!r} ({times} times) in:\n{self.getvalue()}"
            return self.getvalue()


def wait_until(condition: Any, what: str) -> None:
    """Wait for something that nobody tells of, such as the end of somebody else's process."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"no {what} within {PATIENCE} s"
        threading.Event().wait(0.01)


def alive(pid: int) -> bool:
    """Tell whether a process runs; one that has ended and was not reaped does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def program(name: str, *words: str, **settings: Any) -> NodePlan:
    """Return the plan of a process that is no ROS node."""
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
    """A runner in a thread of its own."""

    def __init__(
        self,
        folder: Path,
        plan: Plan,
        *,
        store: MemoryStore | None = None,
        facts: Facts | None = None,
        packages: PackageIndex | None = None,
        environ: Mapping[str, str] | None = None,
        **options: Any,
    ) -> None:
        self.store = store or MemoryStore()
        self.facts = facts or Facts()
        self.out = Transcript()
        self.err = Transcript()
        self.code: int | None = None
        self.raised: BaseException | None = None
        variables = dict(os.environ if environ is None else environ)
        network = options.pop("network", None) or Network(store=self.store, readiness=self.facts)
        environment = Environment(home=folder / "home", log_dir=folder / "log", package_roots=())
        workplace = Workplace(packages or PackageIndex([]), environment, variables, str(folder))
        self.runner = Runner(
            plan, workplace, network, Options(**options), out=self.out, err=self.err
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
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive(), self.out.getvalue() + self.err.getvalue()
        if self.raised is not None:
            raise self.raised
        assert self.code is not None
        return self.code

    def pid(self, label: str, times: int = 1) -> int:
        """Return the process id that a process was started with, the last of so many times."""
        start = f"process[{label}]: started with pid ["
        text = self.out.wait_for(start, times)
        return int(text.split(start)[times].partition("]")[0])


@contextmanager
def launch(
    folder: Path, *nodes: NodePlan, plan: Plan | None = None, **rest: Any
) -> Iterator[Launch]:
    """Run a launch while the block runs, and see that it ends."""
    base = plan or Plan()
    running = Launch(folder, msgspec.structs.replace(base, nodes=(*base.nodes, *nodes)), **rest)
    try:
        yield running
    finally:
        running.runner.stop()
        running._thread.join(PATIENCE)
        assert not running._thread.is_alive()
