"""Generates the modules of packages, and tells whether generated ones are stale."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rosz.errors import DefinitionError, TypeNotFound, near_miss
from rosz.idl.action import action_messages, action_parts
from rosz.idl.catalog import Catalog, Definition
from rosz.idl.module import MARKER, index_module, message_module, service_module

__all__ = (
    "Folders",
    "generate",
    "read_definition",
    "shipped_module",
    "shipped_sources",
    "stale",
    "write",
)


def read_definition(file: Path) -> Definition:
    """Read a definition file.

    Raises:
        DefinitionError: It cannot be read, or is not UTF-8.
    """
    try:
        return Definition(file.read_text("utf-8"), str(file))
    except UnicodeDecodeError as error:
        before = error.object[: error.start]
        line = before.count(b"\n") + 1
        column = error.start - before.rfind(b"\n")
        raise DefinitionError("not UTF-8", str(file), line, column) from error
    except OSError as error:
        raise DefinitionError(f"cannot be read: {error.strerror}", str(file)) from error


class Folders:
    """Definitions in the folders of packages: ``<package>/msg/*.msg`` and ``srv/*.srv``.

    The messages that ROS 1 makes of ``<package>/action/*.action`` count as messages.

    Args:
        folder: Gives the folder of a package by its name; None where there is no such package.
        actions: Whether messages of actions count.
    """

    def __init__(self, folder: Callable[[str], Path | None], *, actions: bool = True) -> None:
        self._folder = folder
        self._actions = actions

    def names(self, package: str, kind: str) -> list[str]:
        """Return the full names of a package's types of one kind, sorted."""
        folder = self._folder(package)
        if folder is None:
            return []
        bases = {file.stem for file in (folder / kind).glob(f"*.{kind}")}
        if kind == "msg" and self._actions:
            actions = (folder / "action").glob("*.action")
            bases.update(part for file in actions for part in action_parts(file.stem))
        return [f"{package}/{kind}/{base}" for base in sorted(bases)]

    def find(self, name: str) -> Definition:
        """Return the definition of a full name.

        Raises:
            TypeNotFound: There is no such package, or no such type in it.
            DefinitionError: The file cannot be read.
        """
        package, kind, base = name.split("/")
        folder = self._folder(package)
        if folder is None:
            raise TypeNotFound(name, f"there is no package '{package}'")
        file = folder / kind / f"{base}.{kind}"
        if not file.is_file():
            made = self._of_action(folder, base) if kind == "msg" and self._actions else None
            if made is not None:
                return made
            known = [one.rpartition("/")[2] for one in self.names(package, kind)]
            raise TypeNotFound(
                name, f"'{folder / kind}' has no '{base}.{kind}'{near_miss(base, known)}"
            )
        return read_definition(file)

    def _of_action(self, folder: Path, base: str) -> Definition | None:
        """Return the definition of a message that an action gives; None if none gives it."""
        for file in (folder / "action").glob("*.action"):
            if base in action_parts(file.stem):
                found = read_definition(file)
                return Definition(action_messages(file.stem, found.text)[base], found.path)
        return None


def shipped_module(name: str) -> str:
    """Return the module in ``rosz.msgs`` of a type's class, by the type's full name."""
    package, kind, _ = name.split("/")
    return f"rosz.msgs.{package}.{kind}"


def generate(
    package: str,
    messages: Sequence[str],
    services: Sequence[str],
    catalog: Catalog,
    place: Callable[[str], str | None],
) -> dict[str, str]:
    """Generate the modules of one package.

    Args:
        package: Its name.
        messages: Full names of its messages.
        services: Full names of its services.
        catalog: All definitions, those that they refer to among them.
        place: Module of a type's class by the type's full name, for imports.

    Returns:
        Sources by file name: ``__init__.py``, and ``msg.py`` and ``srv.py`` as far as it has such.

    Raises:
        DefinitionError: A definition is not well-formed, or refers to what is not there.
    """
    files = {"__init__.py": index_module(package, messages, services)}
    if messages:
        specs = [catalog.message(name) for name in messages]
        files["msg.py"] = message_module(specs, catalog, place, package)
    if services:
        halves = [catalog.service(name) for name in services]
        files["srv.py"] = service_module(halves, catalog, place, package)
    return files


def shipped_sources(interfaces: Path) -> dict[str, dict[str, str]]:
    """Generate the modules of ``rosz.msgs``.

    Args:
        interfaces: The folder with the packages that rosz ships.

    Returns:
        Sources by package and file name.

    Raises:
        DefinitionError: A definition is not well-formed, or refers to what is not there.
    """
    packages = sorted(file.parent.name for file in interfaces.glob("*/package.xml"))
    # Their actions are ROS 2's; who wants ROS 1's messages of them gets them compiled.
    folders = Folders(lambda name: interfaces / name if name in packages else None, actions=False)
    catalog = Catalog(folders.find)
    named = {p: (folders.names(p, "msg"), folders.names(p, "srv")) for p in packages}
    return {
        package: generate(package, messages, services, catalog, shipped_module)
        for package, (messages, services) in named.items()
        if messages or services
    }


def stale(files: dict[str, str], folder: Path) -> Iterator[str]:
    """Yield what differs between generated sources and the files in a folder."""
    for name, source in files.items():
        file = folder / name
        if not file.is_file():
            yield f"{file} is missing"
        elif file.read_text("utf-8") != source:
            yield f"{file} is stale"
    for file in sorted(folder.glob("*.py")):
        if file.name not in files and file.read_text("utf-8").startswith(MARKER):
            yield f"{file} has no definitions any more"


def write(files: dict[str, str], folder: Path) -> None:
    """Write generated sources, and remove generated files that have no definitions any more."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, source in files.items():
        file = folder / name
        if not file.is_file() or file.read_text("utf-8") != source:
            file.write_text(source, "utf-8")
    for file in folder.glob("*.py"):
        if file.name not in files and file.read_text("utf-8").startswith(MARKER):
            file.unlink()
