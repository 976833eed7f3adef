"""Endpoints: the addresses at which Zenoh sessions listen and connect.

``<protocol>/<address>?<metadata>#<configuration>``, such as ``tcp/robot1:7447``,
``tls/[fe80::1]:7447#iface=eth0`` or ``unixsock-stream//run/z.sock``.
"""

from __future__ import annotations

from typing import Final

import msgspec

from rosz.errors import UsageError

_MAX_PORT: Final = 65535
_WITH_PORT: Final = frozenset({"tcp", "udp", "tls", "quic", "ws"})
_PROTOCOLS: Final = _WITH_PORT | {"unixsock-stream", "unixpipe", "vsock", "serial"}
"""Protocols of Zenoh's links; each build of Zenoh has some of them."""


class Endpoint(msgspec.Struct, frozen=True):
    """The address of a Zenoh link; any text is one, and `parse` checks it.

    Attributes:
        text: The endpoint as it was written.
    """

    text: str

    @classmethod
    def parse(cls, text: str, source: str) -> Endpoint:
        """Return the endpoint that a text describes.

        Args:
            text: The text to read.
            source: The setting that the text comes from, for the error.

        Raises:
            UsageError: The protocol is unknown, or the address or its port is missing.
        """
        endpoint = cls(text)
        port_is_good = endpoint.protocol not in _WITH_PORT or endpoint.port is not None
        if endpoint.protocol not in _PROTOCOLS or not endpoint.address or not port_is_good:
            raise UsageError(
                f"{source} is '{text}'; expected PROTOCOL/ADDRESS, such as 'tcp/localhost:7447' or"
                " 'unixsock-stream//tmp/robot.sock'"
            )
        return endpoint

    @classmethod
    def of(cls, protocol: str, host: str, port: int) -> Endpoint:
        """Return the endpoint of a host and port; IPv6 addresses get their brackets."""
        return cls(f"{protocol}/[{host}]:{port}" if ":" in host else f"{protocol}/{host}:{port}")

    @property
    def protocol(self) -> str:
        """The protocol, such as ``tcp``."""
        return self.text.partition("/")[0]

    @property
    def address(self) -> str:
        """The address, such as ``robot1:7447`` or the path of a unix socket."""
        locator = self.text.partition("#")[0].partition("?")[0]
        return locator.partition("/")[2]

    @property
    def host(self) -> str:
        """The host name or IP address, without the brackets of IPv6."""
        return self.address.rpartition(":")[0].strip("[]")

    @property
    def port(self) -> int | None:
        """The port; ``None`` if the address has none."""
        text = self.address.rpartition(":")[2]
        is_port = text.isascii() and text.isdigit() and int(text) <= _MAX_PORT
        return int(text) if is_port else None

    @property
    def configuration(self) -> str:
        """The settings of this link, such as ``iface=eth0``; usually empty."""
        return self.text.partition("#")[2]

    @property
    def is_unix(self) -> bool:
        """Whether it is a unix socket, whose address is a path."""
        return self.protocol == "unixsock-stream"

    @property
    def is_tcp(self) -> bool:
        """Whether its links are TCP connections, with TLS or without."""
        return self.protocol in {"tcp", "tls"}

    @property
    def is_local(self) -> bool:
        """Whether the text says that links to it stay on this machine."""
        local = self.host in {"localhost", "::1"} or self.host.startswith("127.")
        return local or self.protocol.startswith("unix")

    @property
    def is_any_address(self) -> bool:
        """Whether it stands for all addresses of a machine."""
        return self.host in {"0.0.0.0", "::"}  # noqa: S104  # recognised, not listened at

    def secured(self) -> Endpoint:
        """Return the endpoint to use where links beyond this machine need keys.

        Raises:
            UsageError: The protocol cannot use keys.
        """
        if self.protocol == "tls" or self.is_unix or (self.protocol == "tcp" and self.is_local):
            return self
        tls = f"tls/{self.text.partition('/')[2]}"
        if self.protocol == "tcp":
            return Endpoint(tls)
        raise UsageError(
            f"'{self}': with ROSZ_KEYS, links beyond this machine are tls; expected '{tls}'"
        )

    def on_interface(self, name: str) -> Endpoint:
        """Return the endpoint restricted to a network interface."""
        return Endpoint(f"{self.text}#iface={name}")

    def __str__(self) -> str:
        """Return the text."""
        return self.text
