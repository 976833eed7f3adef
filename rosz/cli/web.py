"""``rosz web``: the running system in a browser."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

from rosz.cli.console import print_lines, until_stopped, warn
from rosz.cli.declare import App, Option, at_least

__all__ = ("app",)

app = App()

_LONG = 3600.0
_LAST_PORT = 65535


@app.command()
def web_command(
    *,
    port: Annotated[int, Option("-p --port PORT", "Port to listen at; 0 for any.")] = 8080,
    open_browser: Annotated[bool, Option("--open", "Open the page in the browser.")] = False,
    listen: Annotated[
        str, Option("--listen ADDRESS", "Address to listen at, instead of 127.0.0.1.")
    ] = "127.0.0.1",
    password_file: Annotated[
        str, Option("--password-file FILE", "File whose first line opens the page.")
    ] = "",
    read_only: Annotated[bool, Option("--read-only", "Let the page change nothing.")] = False,
    bags: Annotated[str, Option("--bags FOLDER", "Folder of the bags, instead of this one.")] = ".",
    certificate: Annotated[str, Option("--certificate FILE", "Certificate for TLS.")] = "",
    key: Annotated[str, Option("--key FILE", "Private key of the certificate.")] = "",
) -> None:
    """Show the running system in a browser, until it is stopped.

    Beyond this machine the page needs a password: that of the file, or the one in its address.
    """
    at_least("--port", port, 0, "as a port", _LAST_PORT)
    from rosz.node import Node
    from rosz.web import Settings, open_page

    settings = Settings(
        host=listen,
        port=port,
        password_file=password_file,
        read_only=read_only,
        certificate=certificate,
        key=key,
        bags=Path(bags),
    )
    with until_stopped() as ready, ExitStack() as stack:
        node = stack.enter_context(Node("rosz_web", anonymous=True, argv=()))
        server, (address, *more) = open_page(node, settings)
        stack.callback(server.close)
        ready()
        print_lines([f"the page is at {address}"])
        for line in more:
            warn(line)
        if open_browser:
            import webbrowser

            if not webbrowser.open(address):
                warn(f"no browser opens here; open {address} in one")
        print_lines(["press Ctrl-C to end it"])
        while True:
            time.sleep(_LONG)
