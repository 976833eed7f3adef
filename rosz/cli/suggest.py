"""Sources of completions: names on the network, types, packages and files.

Each source is a function that returns the words that may stand where a person types. A declaration
names its source. Every source answers quickly or not at all, because a person waits after pressing
the TAB key; and this module imports little, because every command imports it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from rosz.environment import Environment
    from rosz.introspect.survey import Survey
    from rosz.packages import PackageIndex
    from rosz.session import Session
    from rosz.typestore import Kind, TypeStore

__all__ = (
    "Line",
    "Source",
    "actions",
    "definitions",
    "executables",
    "files",
    "goal_values",
    "launch_words",
    "machines",
    "nodes",
    "package_file_names",
    "package_paths",
    "packages",
    "packages_and_folders",
    "params",
    "pub_values",
    "request_values",
    "rospack_commands",
    "service_types",
    "services",
    "topic_type",
    "topic_types",
    "topics",
)

_SHARE = 0.3
"""Share of the time limit of a completion that opening a session, or a reply, may take."""
_LAUNCH_FILES = ("*.launch", "*.launch.xml")


class Line:
    """A command line that a person is typing, and the system it is typed on.

    Args:
        environment: The settings.
        cwd: The working folder.
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

    @contextmanager
    def session(self) -> Iterator[Session | None]:
        """Open a session; it is ``None`` when nobody answers at once."""
        from rosz.errors import RoszError
        from rosz.session import Session, SessionConfig, is_listening

        known = self.environment
        session = None
        if known.connect or known.multicast or is_listening(known.rendezvous):
            with suppress(RoszError):
                session = Session.open(SessionConfig.command(known, self.timeout))
        with session or nullcontext():
            yield session

    @property
    def timeout(self) -> float:
        """Time limit of one step, in seconds."""
        return _SHARE * self.environment.completion

    @cached_property
    def survey(self) -> Survey | None:
        """The nodes and topics of the domain; ``None`` when nobody answers."""
        return self.take_survey()

    def take_survey(self, *, processes: bool = False) -> Survey | None:
        """Return the survey, with the processes of the nodes if wanted."""
        from rosz.introspect.survey import take_survey

        with self.session() as session:
            if session is None:
                return None
            return take_survey(session, self.environment.domain, processes=processes)

    @cached_property
    def topics(self) -> dict[str, list[str]]:
        """The topics with their types."""
        return {} if self.survey is None else self.survey.view.topics()

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
    return [*line.topics, *(_fields(line) if "/" in line.word[1:] else ())]


def _fields(line: Line) -> list[str]:
    from rosz.message import slots

    for topic, types in line.topics.items():
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
    return _ros1_types(line.topics.values())


def topic_type(line: Line) -> list[str]:
    """Return the types of the topic before; all message types if it does not exist."""
    return _ros1_types([line.topics.get(line.before[0], [])]) or line.types.names("msg")


def pub_values(line: Line) -> list[str]:
    """Return a message of the type before, with all defaults, as one word of YAML."""
    if len(line.before) != 2:  # noqa: PLR2004  # a topic and a type
        return []
    return [_as_yaml(line.types.message(line.before[1]))]


def services(line: Line) -> list[str]:
    """Return the services."""
    return [] if line.survey is None else list(line.survey.view.services())


def service_types(line: Line) -> list[str]:
    """Return the types of all services."""
    return [] if line.survey is None else _ros1_types(line.survey.view.services().values())


def request_values(line: Line) -> list[str]:
    """Return a request of the service before, with all defaults, as one word of YAML."""
    from rosz.wire import Kind

    if len(line.before) != 1 or line.survey is None:
        return []
    servers = line.survey.view.entities(Kind.SERVICE, name=line.before[0])
    return [_as_yaml(line.types.service(servers[0].type_name).Request)] if servers else []


def actions(line: Line) -> list[str]:
    """Return the actions."""
    from rosz.introspect.actions import list_actions

    survey = line.survey
    return [] if survey is None else [entry.name for entry in list_actions(survey.view)]


def goal_values(line: Line) -> list[str]:
    """Return a goal of the action before, with all defaults, as one word of YAML."""
    from rosz.introspect.actions import find_action

    if len(line.before) != 1 or line.survey is None:
        return []
    return [_as_yaml(line.types.action(find_action(line.survey.view, line.before[0])).Goal)]


def nodes(line: Line) -> list[str]:
    """Return the nodes."""
    return [] if line.survey is None else sorted(set(line.survey.view.nodes()))


def machines(line: Line) -> list[str]:
    """Return the hosts that nodes run on."""
    survey = line.take_survey(processes=True)
    return [] if survey is None else sorted({one.host for one in survey.processes.values()})


def params(line: Line) -> list[str]:
    """Return the parameters."""
    from rosz.params.remote import ParamClient

    with line.session() as session:
        if session is None:
            return []
        return ParamClient(session, line.environment.domain, timeout=line.timeout).names()


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
        paths = (path for path in files(line) if path.endswith(("/", ".launch", ".xml")))
        return [*packages(line), *paths]
    if len(before) == 1 and not before[0].endswith((".launch", ".xml")):
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
        found = sorted((folder / place).iterdir())
    except OSError:
        return []
    return [
        f"{head}{slash}{path.name}{'/' if path.is_dir() else ''}"
        for path in found
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
        return [_plain(one) for one in value]
    return value
