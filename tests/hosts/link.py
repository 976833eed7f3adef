"""Networks of a world, and the cables that join hosts to them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from hosts.namespace import Namespace

if TYPE_CHECKING:
    from hosts.host import Host

__all__ = ("Lan", "Link")

_DEAD, _FORWARDING = "0", "3"


class Lan:
    """A switch, in a namespace of its own.

    Args:
        name: Its name, short enough for interfaces.
        number: Its number, which is the third byte of its addresses.
    """

    def __init__(self, name: str, number: int) -> None:
        self.name = name
        self.prefix = f"10.77.{number}"
        self.namespace = Namespace()
        self._hosts = 0
        self._links: list[Link] = []
        run = self.namespace.run
        run("ip", "link", "add", "switch", "type", "bridge", "mcast_snooping", "0")
        run("ip", "link", "set", "switch", "up")

    def join(self, host: Host) -> Link:
        """Plug a host in, under its next free address."""
        self._hosts += 1
        link = Link(self, host, self._hosts)
        self._links.append(link)
        host.links[self.name] = link
        return link

    def close(self) -> None:
        """Leave nothing of it behind."""
        for link in self._links:
            link.close()
        self.namespace.close()


class Link:
    """A cable from a host to a switch.

    Args:
        lan: The switch.
        host: The host.
        number: Its port, which is the last byte of its address.

    Attributes:
        address: Of the host, here.
    """

    def __init__(self, lan: Lan, host: Host, number: int) -> None:
        self.address = f"{lan.prefix}.{number}"
        self.interface = f"eth{len(host.links)}"
        self._port = f"p{number}"
        self._switch = lan.namespace
        self._host = host.namespace
        self._wire: subprocess.Popen[str] | None = None
        outside, inside = self._switch.run, self._host.run
        peer = ("type", "veth", "peer", "name", self.interface, "netns", str(self._host.pid))
        # Each side sees only its own processes, so a process outside of both names the other.
        subprocess.run(
            ["nsenter", "-t", str(self._switch.pid), "-n", "ip", "link", "add", self._port, *peer],
            check=True,
        )
        outside("ip", "link", "set", self._port, "master", "switch", "up")
        inside("ip", "address", "add", f"{self.address}/24", "dev", self.interface)
        inside("ip", "link", "set", self.interface, "up")

    def cut(self) -> None:
        """Let nothing through any more, either way, without either side being told."""
        self._switch.run("bridge", "link", "set", "dev", self._port, "state", _DEAD)

    def unplug(self) -> None:
        """Cut it so that the host sees that there is no carrier."""
        self._switch.run("ip", "link", "set", self._port, "down")

    def degrade(
        self,
        *,
        delay: float = 0.0,
        loss: float = 0.0,
        rate: float = 0.0,
        duplicate: float = 0.0,
        reorder: float = 0.0,
    ) -> None:
        """Make it bad, both ways, until it is healed.

        Args:
            delay: Seconds that each packet takes longer.
            loss: Share of packets that get lost, 0 to 1.
            rate: Bytes per second at most; 0 for no limit.
            duplicate: Share of packets that come twice, 0 to 1.
            reorder: Share of packets that later ones overtake, 0 to 1.
        """
        self._replug()
        script = Path(__file__).with_name("wire.py")
        names = (f"w{self._port}", f"t{self._port}")
        numbers = map(str, (delay, loss, rate, duplicate, reorder))
        command = [sys.executable, "-I", "-S", str(script), *names, *numbers]
        self._wire = subprocess.Popen(
            self._switch.inside(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._wire.stdout is not None
        if self._wire.stdout.readline() != "up\n":
            pytest.fail("the bad link does not come up")
        run, middle = self._switch.run, f"m{self._port}"
        run("ip", "link", "add", middle, "type", "bridge", "mcast_snooping", "0")
        run("ip", "link", "set", middle, "up")
        run("ip", "link", "set", names[0], "master", "switch", "up")
        run("ip", "link", "set", names[1], "master", middle, "up")
        run("ip", "link", "set", self._port, "master", middle)

    def heal(self) -> None:
        """Make it good again, however it was broken; one that is good stays so."""
        self._replug()
        self._switch.run("ip", "link", "set", self._port, "up")
        self._switch.run("bridge", "link", "set", "dev", self._port, "state", _FORWARDING)

    def _replug(self) -> None:
        """Join the host to the switch again without a bad wire in between."""
        if self._wire is not None:
            self._switch.run("ip", "link", "set", self._port, "master", "switch")
            self._switch.run("ip", "link", "delete", f"m{self._port}")
            self.close()

    def close(self) -> None:
        """Leave no process of it behind; again is no error."""
        if self._wire is None:
            return
        wire, self._wire = self._wire, None
        assert wire.stdin is not None
        assert wire.stdout is not None
        wire.stdin.close()
        wire.wait(60)
        wire.stdout.close()
