"""Sources of completions: names on the network, types, packages and files.

Each source is a function that returns the words that may stand where a person types. A declaration
names its source. What is on the network is asked for within a time limit, because a person waits
after pressing the TAB key; what is on the disk always comes. This module imports little, because
every command imports it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from pathlib import Path
    from threading import Thread

    from rosz.environment import Environment
    from rosz.graph import View
    from rosz.introspect import Survey
    from rosz.packages import PackageIndex
    from rosz.session import Session
    from rosz.typestore import Kind, TypeStore

T = TypeVar("T")
_SHARE = 0.3
"""Share of the time limit of a completion that opening a session, or a reply, may take."""
_LEAST_SECONDS = 0.01
_LAUNCH_FILES = ("*.launch", "*.launch.xml", "*launch.py")


class Line:
    """A command line that a person is typing, and the system it is typed on.

    Args:
        group: The name of the command group.
        before: The positional words before the cursor.
        word: The word at the cursor; may be empty.
    """

    def __init__(
        self, environment: Environment, cwd: Path, group: str, before: Sequence[str], word: str
    ) -> None:
        self.environment = environment
        self.cwd = cwd
        self.group = group
        self.before = before
        self.word = word
        self._deadline = time.monotonic() + environment.completion
        self._asking: Thread | None = None

    def query(self, question: Callable[[Session], T]) -> T | None:
        """Return what a function finds on the network; ``None`` if nobody answers in time.

        It runs on a thread of its own, which is left behind when the time limit is reached.
        """
        from threading import Event, Thread

        from rosz.errors import RoszError

        answers: list[T] = []
        answered = Event()

        def run() -> None:
            try:
                with suppress(RoszError), self._session() as session:
                    if session is not None:
                        answers.append(question(session))
                        answered.set()  # closing a session takes time as well
            finally:
                answered.set()

        self._asking = Thread(target=run, name="rosz-complete", daemon=True)
        self._asking.start()
        answered.wait(self._left)
        return answers[0] if answers else None

    def is_idle(self) -> bool:
        """Wait until nothing is asked any more, within the limit; return whether that is so."""
        if self._asking is not None:
            self._asking.join(self._left)
        return self._asking is None or not self._asking.is_alive()

    @property
    def _left(self) -> float:
        """The seconds that are left."""
        return max(_LEAST_SECONDS, self._deadline - time.monotonic())

    @contextmanager
    def _session(self) -> Iterator[Session | None]:
        """Open a session; it is ``None`` when nobody answers at once."""
        from rosz.errors import RoszError
        from rosz.session import Session, SessionConfig, is_listening

        environment = self.environment
        session = None
        if environment.connect or environment.multicast or is_listening(environment.rendezvous):
            with suppress(RoszError):
                session = Session.open(SessionConfig.command(environment, self.timeout))
        with session or nullcontext():
            yield session

    @property
    def timeout(self) -> float:
        """Time limit of one step, in seconds."""
        return _SHARE * self.environment.completion

    @cached_property
    def view(self) -> View:
        """The nodes and topics of the domain; none when nobody answers."""
        from rosz.graph import View

        survey = self.take_survey()
        return View(()) if survey is None else survey.view

    def take_survey(self, *, processes: bool = False) -> Survey | None:
        """Return the survey, with the processes of the nodes if wanted."""
        from rosz.introspect import take_survey

        return self.query(
            lambda session: take_survey(
                session,
                self.environment.domain,
                processes=processes,
                # Of each of two queries, what has come by then counts.
                timeout=self._left * _SHARE if processes else self._left * 2 * _SHARE,
            )
        )

    @property
    def types(self) -> TypeStore:
        """The message and service types."""
        from rosz.typestore import TypeStore

        return TypeStore(self.packages, self.environment.home / "rosz")

    @property
    def packages(self) -> PackageIndex:
        """The packages on the package path."""
        from rosz.environment import package_index

        return package_index(self.environment)


Source = Callable[[Line], list[str]]
"""Returns the words that may stand at the cursor; not only those that begin as its word does."""


def topics(line: Line) -> list[str]:
    """Return the topics, and the fields of the topic that is being typed."""
    return [*line.view.topics(), *(_fields(line) if "/" in line.word[1:] else ())]


def _fields(line: Line) -> list[str]:
    from rosz.message import slots

    for topic, types in line.view.topics().items():
        if line.word.startswith(f"{topic}/"):
            *path, _ = line.word.removeprefix(f"{topic}/").split("/")
            head = "/".join((topic, *path))
            cls: Any = line.types.message(types[0])
            for part in path:
                cls = next((slot.kind for slot in slots(cls) if slot.name == part), None)
                if not isinstance(cls, type):
                    return []
            return [f"{head}/{slot.name}" for slot in slots(cls)]
    return []


def topic_types(line: Line) -> list[str]:
    """Return the types of all topics."""
    return _ros1_types(line.view.topics().values())


def topic_type(line: Line) -> list[str]:
    """Return the types of the topic before; all message types if it does not exist."""
    types = line.view.topics().get(line.before[0], [])
    return _ros1_types([types]) or line.types.names("msg")


def pub_values(line: Line) -> list[str]:
    """Return a message of the type before, with all defaults, as one word of YAML."""
    if len(line.before) != 2:  # noqa: PLR2004  # a topic and a type
        return []
    return [_as_yaml(line.types.message(line.before[1]))]


def services(line: Line) -> list[str]:
    """Return the services."""
    return list(line.view.services())


def service_types(line: Line) -> list[str]:
    """Return the types of all services."""
    return _ros1_types(line.view.services().values())


def request_values(line: Line) -> list[str]:
    """Return a request of the service before, with all defaults, as one word of YAML."""
    from rosz.wire import Kind

    if len(line.before) != 1:
        return []
    servers = line.view.entities(Kind.SERVICE, name=line.before[0])
    return [_as_yaml(line.types.service(servers[0].type_name).Request)] if servers else []


def actions(line: Line) -> list[str]:
    """Return the actions."""
    from rosz.actions import list_actions

    return [entry.name for entry in list_actions(line.view)]


def goal_values(line: Line) -> list[str]:
    """Return a goal of the action before, with all defaults, as one word of YAML."""
    from rosz.actions import find_action

    if len(line.before) != 1:
        return []
    return [_as_yaml(line.types.action(find_action(line.view, line.before[0])).Goal)]


def nodes(line: Line) -> list[str]:
    """Return the nodes."""
    return sorted(set(line.view.nodes()))


def machines(line: Line) -> list[str]:
    """Return the hosts that nodes run on."""
    survey = line.take_survey(processes=True)
    return [] if survey is None else sorted({process.host for process in survey.processes.values()})


def params(line: Line) -> list[str]:
    """Return the parameters."""
    from rosz.params.replica import ParamClient

    domain, timeout = line.environment.domain, line.timeout
    return line.query(lambda session: ParamClient(session, domain, timeout=timeout).names()) or []


def definitions(line: Line) -> list[str]:
    """Return all types of the kind that the group shows."""
    kinds: dict[str, Kind] = {"srv": "srv", "action": "action"}
    return line.types.names(kinds.get(line.group, "msg"))


def packages(line: Line) -> list[str]:
    """Return the packages."""
    return line.packages.names()


def packages_and_folders(line: Line) -> list[str]:
    """Return the packages, and the folders that begin as the word does."""
    return [*packages(line), *(path for path in files(line) if path.endswith("/"))]


def executables(line: Line) -> list[str]:
    """Return the executables of the package before."""
    return line.packages.find(line.before[0]).executables()


def launch_words(line: Line) -> list[str]:
    """Return packages and files, then the launch files of the package, then the file's args."""
    before = line.before
    if not before:
        paths = (
            path for path in files(line) if path.endswith(("/", ".launch", ".xml", ".launch.py"))
        )
        return [*packages(line), *paths]
    if len(before) == 1 and not before[0].endswith((".launch", ".xml", ".py")):
        folder = line.packages.find(before[0]).path
        return sorted({file.name for pattern in _LAUNCH_FILES for file in folder.rglob(pattern)})
    defaults = _launch_args(line)
    name, assigned, _ = line.word.partition(":=")
    if assigned:
        return [f"{name}:={defaults[name]}"] if defaults.get(name) else []
    given = {word.partition(":=")[0] for word in before}
    return [f"{arg}:=" for arg in defaults if arg not in given]


def _launch_args(line: Line) -> dict[str, str]:
    """Return the args of the launch file before, with their defaults."""
    from rosz.launch.plan import SystemContext, describe_args

    file = line.cwd / line.before[0]
    if not file.is_file() and len(line.before) > 1:
        file = line.packages.find(line.before[0]).file(line.before[1])
    context = SystemContext(line.packages, os.environ, line.cwd, lambda base: base)
    return {arg.name: arg.default or "" for arg in describe_args([file], {}, context)}


def files(line: Line) -> list[str]:
    """Return the files and folders that begin as the word does."""
    return _paths(line.cwd, line.word)


def package_paths(line: Line) -> list[str]:
    """Return the paths ``PACKAGE/PATH`` that begin as the word does."""
    package, slash, rest = line.word.partition("/")
    if not slash:
        return packages(line)
    folder = line.packages.find(package).path
    return [f"{package}/{path}" for path in _paths(folder, rest)]


def package_file_names(line: Line) -> list[str]:
    """Return the packages, then the names of all files of the package before."""
    if not line.before:
        return packages(line)
    folder = line.packages.find(line.before[0]).path
    return sorted({file.name for file in folder.rglob("*") if file.is_file()})


def rospack_commands(line: Line) -> list[str]:
    """Return the commands of rospack, then the packages."""
    return packages(line) if line.before else ["find", "list", "list-names"]


def _ros1_types(types: Iterable[Iterable[str]]) -> list[str]:
    from rosz.names import short_type

    return sorted({short_type(name) for names in types for name in names})


def _paths(folder: Path, word: str) -> list[str]:
    """Return the paths that begin as a word does, folders with a slash at the end."""
    from pathlib import Path

    head, slash, start = word.rpartition("/")
    place = Path(head + slash).expanduser() if slash else Path()
    try:
        entries = sorted((folder / place).iterdir())
    except OSError:
        return []
    return [
        f"{head}{slash}{path.name}{'/' if path.is_dir() else ''}"
        for path in entries
        if path.name.startswith(start) and (start or not path.name.startswith("."))
    ]


def _as_yaml(cls: Any) -> str:
    import yaml

    text = yaml.safe_dump(_plain(cls()), default_flow_style=True, sort_keys=False, width=1 << 20)
    return str(text).removesuffix("\n")


def _plain(value: Any) -> Any:
    if hasattr(value, "__slots__") and hasattr(value, "_schema"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, bytes | bytearray) or hasattr(value, "tolist"):
        return list(value)
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value
