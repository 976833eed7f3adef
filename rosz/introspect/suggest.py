"""What a person may mean where a name is being typed: names of the live network, and of files.

Everything here answers quickly or with nothing: whoever presses the TAB key waits.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosz.environment import Environment, package_index
from rosz.errors import RoszError
from rosz.introspect.survey import Survey, take_survey
from rosz.names import short_type
from rosz.packages import PackageIndex
from rosz.session import Session, SessionConfig, is_listening
from rosz.wire import Kind

if TYPE_CHECKING:
    from rosz.typestore import TypeStore

__all__ = ("Suggestions",)

_SHARE = 0.3
"""Of the time that a person waits, what opening a session may take, and what an answer may."""

_LAUNCH = ("*.launch", "*.launch.xml")


class Suggestions:
    """Names of all kinds, looked up when asked for.

    Args:
        environment: Settings.
        cwd: The working folder.
    """

    def __init__(self, environment: Environment, cwd: Path) -> None:
        self._environment = environment
        self._cwd = cwd
        self._found: Survey | None = None

    @contextmanager
    def _session(self) -> Iterator[Session | None]:
        """Open a session if somebody is there to talk to at once."""
        known = self._environment
        if not (known.connect or known.multicast or is_listening(known.rendezvous)):
            yield None
            return
        try:
            session = Session.open(SessionConfig.command(known, _SHARE * known.completion))
        except RoszError:
            yield None
            return
        with session:
            yield session

    def _survey(self, *, processes: bool = False) -> Survey | None:
        if self._found is None:
            with self._session() as session:
                if session is not None:
                    self._found = take_survey(
                        session, self._environment.domain, processes=processes
                    )
        return self._found

    @property
    def _types(self) -> TypeStore:
        from rosz.typestore import TypeStore

        return TypeStore(self._packages, self._environment.home / "rosz")

    @property
    def _packages(self) -> PackageIndex:
        return package_index(self._environment)

    def topics(self) -> list[str]:
        """Return the names of all topics."""
        survey = self._survey()
        return [] if survey is None else list(survey.view.topics())

    def topic_types(self) -> list[str]:
        """Return the types of all topics, as ROS 1 spells them."""
        survey = self._survey()
        return [] if survey is None else _flat(survey.view.topics().values())

    def type_of_topic(self, topic: str) -> list[str]:
        """Return the types of a topic; of one that is not there, all that are known."""
        survey = self._survey()
        known = [] if survey is None else survey.view.topics().get(topic, [])
        return [short_type(name) for name in known] or self.messages()

    def fields(self, word: str) -> list[str]:
        """Return the fields of a topic that a word names, with a part of a field or without."""
        from rosz.message import slots

        survey = self._survey()
        for topic, types in ({} if survey is None else survey.view.topics()).items():
            if word.startswith(f"{topic}/"):
                *path, _ = word.removeprefix(f"{topic}/").split("/")
                head = "/".join((topic, *path))
                cls: Any = self._types.message(types[0])
                for part in path:
                    cls = next((s.kind for s in slots(cls) if s.name == part), None)
                    if not isinstance(cls, type):
                        return []
                return [f"{head}/{slot.name}" for slot in slots(cls)]
        return []

    def services(self) -> list[str]:
        """Return the names of all services."""
        survey = self._survey()
        return [] if survey is None else list(survey.view.services())

    def service_types(self) -> list[str]:
        """Return the types of all services, as ROS 1 spells them."""
        survey = self._survey()
        return [] if survey is None else _flat(survey.view.services().values())

    def nodes(self) -> list[str]:
        """Return the names of all nodes."""
        survey = self._survey()
        return [] if survey is None else sorted(set(survey.view.nodes()))

    def machines(self) -> list[str]:
        """Return the hosts that nodes run on."""
        survey = self._survey(processes=True)
        return [] if survey is None else sorted({p.host for p in survey.processes.values()})

    def params(self) -> list[str]:
        """Return the names of all parameters."""
        from rosz.params.remote import ParamClient

        with self._session() as session:
            if session is None:
                return []
            timeout = _SHARE * self._environment.completion
            client = ParamClient(session, self._environment.domain, timeout=timeout)
            return client.names()

    def message(self, type_name: str) -> list[str]:
        """Return a message of a type with all its defaults, as a line of YAML."""
        return [_prototype(self._types.message(type_name))]

    def request(self, service: str) -> list[str]:
        """Return a request of a service with all its defaults, as a line of YAML."""
        survey = self._survey()
        servers = [] if survey is None else survey.view.entities(Kind.SERVICE, name=service)
        if not servers:
            return []
        return [_prototype(self._types.service(servers[0].type_name).Request)]

    def messages(self) -> list[str]:
        """Return the names of all message types, as ROS 1 spells them."""
        return self._types.names("msg")

    def service_definitions(self) -> list[str]:
        """Return the names of all service types, as ROS 1 spells them."""
        return self._types.names("srv")

    def packages(self) -> list[str]:
        """Return the names of all packages."""
        return self._packages.names()

    def executables(self, package: str) -> list[str]:
        """Return what may be executed in a package."""
        return self._packages.find(package).executables()

    def launch_files(self, package: str) -> list[str]:
        """Return the names of the launch files of a package."""
        folder = self._packages.find(package).path
        return sorted({file.name for pattern in _LAUNCH for file in folder.rglob(pattern)})

    def launch_args(self, words: list[str]) -> dict[str, str]:
        """Return the args of a launch file, each with its default.

        Args:
            words: A package and a file in it, or a path.
        """
        from rosz.launch.plan import SystemContext, describe_args

        context = SystemContext(self._packages, os.environ, self._cwd, lambda base: base)
        args = describe_args([self._launch_file(words)], {}, context)
        return {arg.name: arg.default or "" for arg in args}

    def _launch_file(self, words: list[str]) -> Path:
        file = self._cwd / words[0]
        if file.is_file() or len(words) == 1:
            return file
        return self._packages.find(words[0]).file(words[1])

    def inside(self, word: str) -> list[str]:
        """Return the folders and files that begin as a word ``package/part`` does."""
        package, slash, rest = word.partition("/")
        if not slash:
            return self.packages()
        folder = self._packages.find(package).path
        return [f"{package}/{name}" for name in _files(folder, rest)]

    def files_of(self, package: str) -> list[str]:
        """Return the names of all files of a package."""
        folder = self._packages.find(package).path
        return sorted({file.name for file in folder.rglob("*") if file.is_file()})

    def files(self, word: str) -> list[str]:
        """Return the folders and files that begin as a word does."""
        return _files(self._cwd, word)


def _flat(types: Any) -> list[str]:
    return sorted({short_type(name) for names in types for name in names})


def _files(folder: Path, word: str) -> list[str]:
    """Return paths as they were begun, folders with a slash behind."""
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


def _prototype(cls: Any) -> str:
    import yaml

    plain = _plain(cls())
    return str(
        yaml.safe_dump(plain, default_flow_style=True, sort_keys=False, width=1 << 20)
    ).removesuffix("\n")


def _plain(value: Any) -> Any:
    if hasattr(value, "__slots__") and hasattr(value, "_schema"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, bytes | bytearray) or hasattr(value, "tolist"):
        return list(value)
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return value
