"""What rosz takes from the process environment, read in this one place.

ROS's own variables keep their meaning (``ROS_DOMAIN_ID``, ``ROS_NAMESPACE``, ``ROS_PACKAGE_PATH``,
``ROS_HOME``, ``ROS_LOG_DIR``, ``ROS_DISTRO``, rmw_zenoh's ``ZENOH_SESSION_CONFIG_URI`` and
``ZENOH_CONFIG_OVERRIDE``); those of rosz begin with ``ROSZ_``.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import msgspec

from rosz.errors import UsageError
from rosz.packages import PackageIndex

__all__ = ("DEFAULT_RENDEZVOUS", "Environment", "package_index")

DEFAULT_RENDEZVOUS = "tcp/localhost:7447"
"""Where sessions of one machine meet; rmw_zenoh's router port."""

_MAX_DOMAIN = 232


class Environment(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of this process.

    Attributes:
        domain: ``ROS_DOMAIN_ID``, 0 when unset; domains do not see each other.
        rendezvous: ``ROSZ_RENDEZVOUS``, the endpoint where local sessions meet.
        connect: ``ROSZ_CONNECT``, endpoints of other machines, separated by commas.
        listen: ``ROSZ_LISTEN``, endpoints to accept other machines on, separated by commas.
        mode: ``ROSZ_MODE``: ``peer`` (mesh) or ``client`` (of the core at the rendezvous, or of
            one of ``connect``); when unset, ``client`` where ``connect`` is given and ``listen``
            is not: nothing can dial a peer that listens on loopback alone, so a mesh would end at
            the machine.
        multicast: ``ROSZ_MULTICAST=1`` looks for others on the local network.
        shared_memory: ``ROSZ_SHM``: samples of so many bytes and more go by shared memory; 0: off.
        keys: ``ROSZ_KEYS``, folder of the keys that links beyond this machine need.
        namespace: ``ROS_NAMESPACE``.
        distro: ``ROS_DISTRO``; ``humble`` selects that release's wire format.
        zenoh_config: ``ZENOH_SESSION_CONFIG_URI``, a Zenoh configuration file.
        zenoh_override: ``ZENOH_CONFIG_OVERRIDE``, ``path/to/key=json;…``.
        package_roots: Folders to look for packages in, first ones first.
        completion: ``ROSZ_COMPLETION_TIMEOUT``: seconds that the TAB key waits at most; 0.5.
        console_format: ``ROSCONSOLE_FORMAT``.
        color: Whether terminals get colours; ``NO_COLOR`` and ``TERM=dumb`` say no.
        home: ``ROS_HOME`` or ``~/.ros``.
        log_dir: ``ROS_LOG_DIR`` or ``<home>/log``.
    """

    domain: int = 0
    rendezvous: str = DEFAULT_RENDEZVOUS
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    mode: Literal["peer", "client"] = "peer"
    multicast: bool = False
    shared_memory: int = 0
    keys: Path | None = None
    namespace: str = ""
    distro: str = ""
    zenoh_config: str = ""
    zenoh_override: str = ""
    package_roots: tuple[Path, ...] = ()
    completion: float = 0.5
    console_format: str = ""
    color: bool = True
    home: Path = Path(".ros")
    log_dir: Path = Path(".ros/log")

    @classmethod
    def read(cls, environ: Mapping[str, str] | None = None, cwd: Path | None = None) -> Environment:
        """Read the settings.

        Args:
            environ: Variables; those of the process when not given.
            cwd: Folder whose workspace is searched for packages; the working one when not given.

        Raises:
            UsageError: A variable has a value that means nothing.
        """
        env = os.environ if environ is None else environ
        home = Path(env.get("ROS_HOME") or Path(env.get("HOME") or "/") / ".ros")
        connect = _endpoints("ROSZ_CONNECT", env)
        listen = _endpoints("ROSZ_LISTEN", env)
        return cls(
            domain=_domain(env.get("ROS_DOMAIN_ID", "")),
            rendezvous=_endpoint("ROSZ_RENDEZVOUS", env.get("ROSZ_RENDEZVOUS", ""))
            or DEFAULT_RENDEZVOUS,
            connect=connect,
            listen=listen,
            mode=_mode(env.get("ROSZ_MODE", ""), dials=bool(connect and not listen)),
            multicast=_switch("ROSZ_MULTICAST", env),
            shared_memory=_bytes("ROSZ_SHM", env.get("ROSZ_SHM", "")),
            keys=Path(env["ROSZ_KEYS"]).expanduser().absolute() if env.get("ROSZ_KEYS") else None,
            namespace=env.get("ROS_NAMESPACE", ""),
            distro=env.get("ROS_DISTRO", ""),
            zenoh_config=env.get("ZENOH_SESSION_CONFIG_URI", ""),
            zenoh_override=env.get("ZENOH_CONFIG_OVERRIDE", ""),
            package_roots=_package_roots(env, cwd or _working_folder()),
            completion=_seconds("ROSZ_COMPLETION_TIMEOUT", env, 0.5),
            console_format=env.get("ROSCONSOLE_FORMAT", ""),
            color=not env.get("NO_COLOR") and env.get("TERM") != "dumb",
            home=home,
            log_dir=Path(env.get("ROS_LOG_DIR") or home / "log"),
        )


def package_index(environment: Environment) -> PackageIndex:
    """Return the packages on the path, then those that rosz and pip-installed packages bring.

    Installed distributions register folders of packages under the entry point group
    ``rosz.packages``: each entry names a module, and its folder is searched.
    """
    # Asking what is installed takes longer than most commands do, and few need it.
    return PackageIndex(
        lambda: [*environment.package_roots, *_registered_roots(), *shipped_roots()]
    )


def shipped_roots() -> list[Path]:
    """Return the folders of packages that rosz itself carries."""
    package = Path(__file__).parent
    share = package / "share"
    source_tree = package.parent / "interfaces"
    return [share, *([source_tree] if not (share / "interfaces").is_dir() else [])]


def _registered_roots() -> list[Path]:
    from importlib.metadata import entry_points
    from importlib.util import find_spec

    roots: list[Path] = []
    for entry in entry_points(group="rosz.packages"):
        spec = find_spec(entry.module)
        if spec is not None and spec.submodule_search_locations:
            roots += [Path(folder) for folder in spec.submodule_search_locations]
        elif spec is not None and spec.origin:
            roots.append(Path(spec.origin).parent)
    return roots


def _package_roots(env: Mapping[str, str], cwd: Path) -> tuple[Path, ...]:
    listed = [
        Path(part).expanduser().absolute()
        for name in ("ROSZ_PACKAGE_PATH", "ROS_PACKAGE_PATH")
        for part in env.get(name, "").split(os.pathsep)
        if part
    ]
    return tuple(dict.fromkeys([*listed, *_workspace(cwd)]))


def _workspace(cwd: Path) -> list[Path]:
    """Find the workspace around a folder: the nearest ``src`` upwards, or the package it is in."""
    for folder in [cwd, *cwd.parents]:
        if folder.name == "src":
            return [folder]
        if (folder / "src").is_dir() and not (folder / "package.xml").is_file():
            return [folder / "src"]
    for folder in [cwd, *cwd.parents]:
        if (folder / "package.xml").is_file():
            return [folder]
    return []


def _working_folder() -> Path:
    try:
        return Path.cwd()
    except FileNotFoundError:  # deleted under a running shell
        return Path("/")


def _endpoints(name: str, env: Mapping[str, str]) -> tuple[str, ...]:
    parts = env.get(name, "").split(",")
    return tuple(_endpoint(name, part.strip()) for part in parts if part.strip())


def _endpoint(name: str, text: str) -> str:
    if not text:
        return ""
    from rosz.wire import Endpoint  # unset in most processes, which can do without the import

    return str(Endpoint.parse(text, name))


def _switch(name: str, env: Mapping[str, str]) -> bool:
    text = env.get(name, "")
    if text not in {"", "0", "1"}:
        raise UsageError(f"{name} is '{text}'; expected '1' for on, '0' for off")
    return text == "1"


def _domain(text: str) -> int:
    if not text:
        return 0
    if not text.isascii() or not text.isdigit() or int(text) > _MAX_DOMAIN:
        raise UsageError(f"ROS_DOMAIN_ID is '{text}'; expected a number from 0 to {_MAX_DOMAIN}")
    return int(text)


def _mode(text: str, *, dials: bool) -> Literal["peer", "client"]:
    if text == "client" or (dials and not text):
        return "client"
    if text in {"", "peer"}:
        return "peer"
    raise UsageError(f"ROSZ_MODE is '{text}'; expected 'peer' or 'client'")


def _seconds(name: str, env: Mapping[str, str], default: float) -> float:
    text = env.get(name, "")
    try:
        seconds = float(text) if text else default
    except ValueError:
        seconds = 0.0
    if not 0 < seconds < math.inf:
        raise UsageError(f"{name} is '{text}'; expected a number of seconds")
    return seconds


def _bytes(name: str, text: str) -> int:
    if not text:
        return 0
    if not text.isascii() or not text.isdigit():
        raise UsageError(f"{name} is '{text}'; expected a number of bytes, 0 for off")
    return int(text)
