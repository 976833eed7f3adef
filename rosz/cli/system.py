"""``rosz doctor``, ``rosz web`` and ``rosz help``: the whole system, and the manual about it."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rosz.cli.commands import COMMANDS, format_rows
from rosz.cli.console import (
    count,
    paint,
    print_json,
    print_lines,
    takes_escapes,
    until_stopped,
    warn,
)
from rosz.cli.declare import App, Argument, Json, Option, at_least, seconds
from rosz.errors import NotFoundError, near_miss
from rosz.names import printable

if TYPE_CHECKING:
    from rosz.doctor import Examination, Finding

doctor = App()
web = App()
manual = App()

_LONG = 3600.0
_LAST_PORT = 65535
_MANUAL = Path(__file__).parents[1] / "share" / "manual"


@doctor.command()
def doctor_command(
    *,
    wait: Annotated[float, Option("--wait SECONDS", "Time limit for listening to samples.")] = 1.0,
    json: Json = False,
) -> int:
    """Find problems on this machine and network, and print what shows them and what to do.

    The exit code is 1 if there is an error. A warning, which may be intended, is not an error.
    """
    if wait:
        seconds("--wait", wait)
    from rosz.doctor import Examination, examine
    from rosz.environment import Environment

    examination = Examination(environment=Environment.read(), listen=wait)
    findings = examine(examination)
    if json:
        shown = list(findings)
        print_json(shown)
    else:
        shown = _show(findings, examination)
    return int(any(finding.level == "error" for finding in shown))


def _show(findings: Iterable[Finding], examination: Examination) -> list[Finding]:
    from rosz.doctor import listed

    colored = examination.environment.color and takes_escapes(sys.stdout)
    shown: list[Finding] = []
    for finding in findings:
        shown.append(finding)
        title = paint(f"{finding.level.upper()} {finding.name}", finding.level if colored else "")
        evidence = "".join(f"  - {line}\n" for line in listed(finding.evidence))
        text = printable(f"{finding.text}\n{evidence}  what to do: {finding.remedy}\n")
        sys.stdout.write(f"{title}: {text}\n")
        sys.stdout.flush()
    errors = sum(finding.level == "error" for finding in shown)
    counts = f"{count(errors, 'error')}, {count(len(shown) - errors, 'warning')}"
    verdict = counts if shown else "all is well"
    print_lines([f"looked at {count(examination.nodes, 'node')}: {verdict}"])
    return shown


@web.command()
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
    from rosz.web import PageSettings, open_page

    settings = PageSettings(
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


def pages() -> dict[str, Path]:
    """Return the pages of the manual by topic."""
    return {path.stem: path for path in sorted(_MANUAL.glob("*.md"))}


def topics() -> dict[str, str]:
    """Return the title of each page of the manual, which is its first heading, by topic."""
    titles = {}
    for topic, path in pages().items():
        lines = path.read_text(encoding="utf-8").splitlines()
        headings = (line for line in lines if line.startswith("#"))
        titles[topic] = next(headings, topic).lstrip("# ")
    return titles


@manual.command()
def help_command(
    topic: Annotated[
        str, Argument("TOPIC", "A page of the manual, or a command; lists the pages if empty.")
    ] = "",
) -> None:
    """Print a page of the manual, or list the pages.

    'rosz help COMMAND' prints what 'rosz COMMAND --help' prints, unless a page has that name.
    """
    paths = pages()
    if not topic:
        sys.stdout.write(f"Usage: rosz help TOPIC\n\nTopics:\n{format_rows(topics().items())}")
    elif topic in paths:
        sys.stdout.write(paths[topic].read_text(encoding="utf-8"))
    else:
        hint = near_miss(topic, [*paths, *COMMANDS]) or "; 'rosz help' lists the topics"
        raise NotFoundError(f"no page of the manual is called '{topic}'{hint}")
