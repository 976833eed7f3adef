"""The environment variables of this process, which are read only here.

ROS's own variables keep their meaning (``ROS_DOMAIN_ID``, ``ROS_NAMESPACE``, ``ROS_PACKAGE_PATH``,
``ROS_HOME``, ``ROS_LOG_DIR``, ``ROS_DISTRO``, catkin's ``CMAKE_PREFIX_PATH``, rmw_zenoh's
``ZENOH_SESSION_CONFIG_URI`` and ``ZENOH_CONFIG_OVERRIDE``); those of rosz begin with ``ROSZ_``.
"""

from __future__ import annotations

import math
import os
import stat
from collections.abc import Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Literal

import msgspec

from rosz.errors import UsageError
from rosz.packages import SYSTEM, PackageIndex, manifest_of

DEFAULT_RENDEZVOUS = "tcp/localhost:7447"
"""The endpoint where the sessions of one machine meet, with the port of rmw_zenoh's router."""

_MAX_DOMAIN = 232
_BAG_LIMIT = 128 << 20
_CATKIN_MARKER = ".catkin"
_PRIVATE = "private"
_WINDOWS = Path(__file__).parent / "web" / "windows"
"""The folder of the packages whose programs open pages in place of rqt and rviz."""
_USER_FOLDERS = Path("/run/user")
"""Where systemd makes a folder for each user who is logged in."""


class Environment(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of this process.

    Attributes:
        domain: ``ROS_DOMAIN_ID``, 0 when unset; domains do not see each other.
        rendezvous: ``ROSZ_RENDEZVOUS``, the endpoint where local sessions meet; ``private`` is a
            unix socket in a folder that only this user can enter.
        connect: ``ROSZ_CONNECT``, endpoints of other machines, separated by commas.
        listen: ``ROSZ_LISTEN``, endpoints to accept other machines on, separated by commas.
        mode: ``ROSZ_MODE``: ``peer`` (mesh) or ``client`` (of the core at the rendezvous, or of
            one of ``connect``). When unset, it is ``client`` if ``connect`` is given and ``listen``
            is not: others cannot connect to a peer that listens on loopback only, so a mesh would
            end at the machine.
        multicast: ``ROSZ_MULTICAST=1``: whether to look for others on the local network.
        shared_memory: ``ROSZ_SHM``, the size in bytes from which samples use shared memory; 0: off.
        keys: ``ROSZ_KEYS``, the folder of the keys that links beyond this machine need.
        namespace: ``ROS_NAMESPACE``.
        distro: ``ROS_DISTRO``; ``humble`` selects that release's wire format.
        zenoh_config: ``ZENOH_SESSION_CONFIG_URI``, a Zenoh configuration file.
        zenoh_override: ``ZENOH_CONFIG_OVERRIDE``, ``path/to/key=json;…``.
        package_roots: The folders to search for packages, in this order.
        prefixes: The devel and install spaces of catkin in ``CMAKE_PREFIX_PATH``.
        completion: ``ROSZ_COMPLETION_TIMEOUT``, the longest time in seconds that the TAB key waits
            for the network; 0.5 when unset.
        console_format: ``ROSCONSOLE_FORMAT``.
        color: Whether terminals get colours; not with ``NO_COLOR`` or ``TERM=dumb``.
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
    prefixes: tuple[Path, ...] = ()
    completion: float = 0.5
    console_format: str = ""
    color: bool = True
    home: Path = Path(".ros")
    log_dir: Path = Path(".ros/log")

    @classmethod
    def read(cls, environ: Mapping[str, str] | None = None, cwd: Path | None = None) -> Environment:
        """Read the settings.

        Args:
            environ: The variables; those of the process when not given.
            cwd: The folder whose workspace is searched for packages; the working directory when not
                given.

        Raises:
            UsageError: A variable has a value without a meaning.
        """
        env = os.environ if environ is None else environ
        home = Path(env.get("ROS_HOME") or Path(env.get("HOME") or _home_of_user()) / ".ros")
        connect = _endpoints("ROSZ_CONNECT", env)
        listen = _endpoints("ROSZ_LISTEN", env)
        return cls(
            domain=_number("ROS_DOMAIN_ID", env, f"a number from 0 to {_MAX_DOMAIN}", _MAX_DOMAIN),
            rendezvous=_rendezvous(env.get("ROSZ_RENDEZVOUS", "")),
            connect=connect,
            listen=listen,
            mode=_mode(env.get("ROSZ_MODE", ""), dials=bool(connect and not listen)),
            multicast=_switch("ROSZ_MULTICAST", env),
            shared_memory=_number("ROSZ_SHM", env, "a number of bytes, 0 for off"),
            keys=Path(env["ROSZ_KEYS"]).expanduser().absolute() if env.get("ROSZ_KEYS") else None,
            namespace=env.get("ROS_NAMESPACE", ""),
            distro=env.get("ROS_DISTRO", ""),
            zenoh_config=env.get("ZENOH_SESSION_CONFIG_URI", ""),
            zenoh_override=env.get("ZENOH_CONFIG_OVERRIDE", ""),
            package_roots=_package_roots(env, cwd or _working_folder()),
            prefixes=_prefixes(env.get("CMAKE_PREFIX_PATH", "")),
            completion=_seconds("ROSZ_COMPLETION_TIMEOUT", env, 0.5),
            console_format=env.get("ROSCONSOLE_FORMAT", ""),
            color=not env.get("NO_COLOR") and env.get("TERM") != "dumb",
            home=home,
            log_dir=Path(env.get("ROS_LOG_DIR") or home / "log"),
        )


def bag_limit() -> int:
    """Return ``ROSZ_BAG_LIMIT``: the most bytes that a part of a bag may unpack to.

    Raises:
        UsageError: The variable has a value without a meaning.
    """
    return _number("ROSZ_BAG_LIMIT", os.environ, "a number of bytes") or _BAG_LIMIT


def package_index(environment: Environment) -> PackageIndex:
    """Return the packages on the path, then those of pip-installed packages, rosz and Debian.

    Installed distributions register folders of packages under the entry point group
    ``rosz.packages``: each entry names a module, and its folder is searched.

    Where there is a screen, Debian's rviz and rqt go before the pages that take their place.
    """
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    # Reading the list of installed distributions takes longer than most commands do.
    return PackageIndex(
        lambda: [*environment.package_roots, *_registered_roots(), *_shipped_roots()],
        prefixes=environment.prefixes,
        later=(SYSTEM, _WINDOWS) if screen else (_WINDOWS, SYSTEM),
    )


def _shipped_roots() -> list[Path]:
    """Return the folders of the packages that are part of rosz."""
    share = Path(__file__).parent / "share"
    source_tree = share.parent.parent / "interfaces"
    return [share] if (share / "interfaces").is_dir() else [share, source_tree]


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


def _home_of_user() -> str:
    """Return the home of the user by the password file, as of a service without ``HOME``."""
    import pwd

    try:
        return pwd.getpwuid(os.geteuid()).pw_dir
    except KeyError:  # a number without a name, as in containers
        return "/"


def _package_roots(env: Mapping[str, str], cwd: Path) -> tuple[Path, ...]:
    listed = [
        Path(part).expanduser().absolute()
        for name in ("ROSZ_PACKAGE_PATH", "ROS_PACKAGE_PATH")
        for part in env.get(name, "").split(os.pathsep)
        if part
    ]
    return tuple(dict.fromkeys([*listed, *_workspace(cwd)]))


def _prefixes(text: str) -> tuple[Path, ...]:
    folders = (Path(part) for part in text.split(os.pathsep) if part)
    return tuple(folder for folder in folders if (folder / _CATKIN_MARKER).is_file())


def _workspace(cwd: Path) -> list[Path]:
    """Return the workspace of a folder: the nearest ``src`` above it, or its package."""
    for folder in [cwd, *cwd.parents]:
        if folder.name == "src":
            return [folder]
        if (folder / "src").is_dir() and manifest_of(folder) is None:
            return [folder / "src"]
    packages = (folder for folder in [cwd, *cwd.parents] if manifest_of(folder) is not None)
    return list(islice(packages, 1))


def _working_folder() -> Path:
    try:
        return Path.cwd()
    except FileNotFoundError:  # deleted under a running shell
        return Path("/")


def _endpoints(name: str, env: Mapping[str, str]) -> tuple[str, ...]:
    parts = [part.strip() for part in env.get(name, "").split(",")]
    return tuple(_endpoint(name, part) for part in parts if part)


def _rendezvous(text: str) -> str:
    if text != _PRIVATE:
        return _endpoint("ROSZ_RENDEZVOUS", text) if text else DEFAULT_RENDEZVOUS
    # Named by the user's number alone, so that all programs of the user agree on it.
    user = os.geteuid()
    own = _USER_FOLDERS / str(user)
    folder = own / "rosz" if own.is_dir() else Path(f"/tmp/rosz-{user}")  # noqa: S108  # checked
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != user or status.st_mode & 0o077:
        raise UsageError(
            f"ROSZ_RENDEZVOUS is '{_PRIVATE}', but '{folder}' is not a folder that only you can"
            f" enter; 'ls -ld {folder}' shows whose it is: remove it, or name another place,"
            " 'unixsock-stream/FOLDER/z.sock' with a folder of your own (chmod 700)"
        )
    return f"unixsock-stream/{folder}/z.sock"


def _endpoint(name: str, text: str) -> str:
    from rosz.wire import Endpoint  # unset in most processes, which can do without the import

    return str(Endpoint.parse(text, name))


def _switch(name: str, env: Mapping[str, str]) -> bool:
    text = env.get(name, "")
    if text not in {"", "0", "1"}:
        raise UsageError(f"{name} is '{text}'; expected '1' for on, '0' for off")
    return text == "1"


def _number(name: str, env: Mapping[str, str], expected: str, largest: float = math.inf) -> int:
    text = env.get(name, "") or "0"
    if not text.isascii() or not text.isdigit() or int(text) > largest:
        raise UsageError(f"{name} is '{text}'; expected {expected}")
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
