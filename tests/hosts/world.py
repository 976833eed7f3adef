"""A few machines on one: hosts, the networks that join them, and no trace of them afterwards.

Each host is a set of Linux namespaces, so it has its own loopback, addresses, processes, host name
and home, and the usual ports and settings are free on it. ::

    def test_something(world: World) -> None:
        robot, laptop = world.hosts("robot", "laptop")
        core = robot.rosz("core", "--listen", "tcp/0.0.0.0:7447")
        core.wait_for("started core")
        print(laptop.ask("topic", "list", ROSZ_CONNECT="tcp/robot:7447"))
        robot.link.cut()
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Self

from hosts.host import Host, HostProgram
from hosts.link import Lan, Link
from hosts.namespace import why_not

__all__ = ("Host", "HostProgram", "Lan", "Link", "World", "why_not")


class World:
    """All hosts and networks of one test.

    Attributes:
        folder: Where their files are.
    """

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="rosz-world-"))
        self.folder.chmod(0o755)
        (self.folder / "hosts").write_text("127.0.0.1 localhost\n::1 localhost\n")
        self._lans: dict[str, Lan] = {}
        self._hosts: list[Host] = []

    def lan(self, name: str = "lan") -> Lan:
        """Return a network, made when it is first asked for."""
        if name not in self._lans:
            self._lans[name] = Lan(name, len(self._lans))
        return self._lans[name]

    def host(self, name: str, *lans: str) -> Host:
        """Return a new host, joined to some networks, or to the one called ``lan``."""
        made = Host(name, self.folder)
        self._hosts.append(made)
        for lan in lans or ("lan",):
            self.lan(lan).join(made)
        with (self.folder / "hosts").open("a") as file:
            file.write(f"{made.address} {name}\n")
        return made

    def hosts(self, *names: str) -> list[Host]:
        """Return new hosts on one network."""
        return [self.host(name) for name in names]

    def close(self) -> None:
        """Leave nothing of it behind."""
        for host in self._hosts:
            host.close()
        for lan in self._lans.values():
            lan.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exc: object) -> None:
        self.close()
