"""``rosz doctor``: what is wrong, what shows it, and what to do; roswtf's successor."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from rosz.cli.bounds import seconds
from rosz.cli.declare import App, Option
from rosz.cli.group import print_json, takes_escapes

if TYPE_CHECKING:
    from rosz.doctor import Examination, Finding

__all__ = ("app",)

app = App()
_COLORS = {"error": "31", "warning": "33"}


@app.command()
def doctor_command(
    *,
    wait: Annotated[
        float, Option(metavar="SECONDS", help="Listen to samples for so long, at most.")
    ] = 1.0,
    json: Annotated[bool, Option("--json", help="As JSON.")] = False,
) -> int:
    """Name what is wrong on this machine and network, with what shows it and what to do.

    Exit code 1 if there is an error; a warning, which may be meant, is none.
    """
    if wait:
        seconds("--wait", wait)
    from rosz.doctor import Examination, examine
    from rosz.environment import Environment

    examination = Examination(environment=Environment.read(), listen=wait)
    findings = examine(examination)
    if json:
        found = list(findings)
        print_json(found)
    else:
        found = _show(findings, examination)
    return int(any(finding.level == "error" for finding in found))


def _show(findings: Iterable[Finding], examination: Examination) -> list[Finding]:
    """Print findings as they come, and return them."""
    from rosz.doctor import listed

    colored = examination.environment.color and takes_escapes(sys.stdout)
    found: list[Finding] = []
    for finding in findings:
        found.append(finding)
        title = f"{finding.level.upper()} {finding.name}"
        if colored:
            title = f"\033[{_COLORS[finding.level]}m{title}\033[0m"
        evidence = "".join(f"  - {line}\n" for line in listed(finding.evidence))
        sys.stdout.write(f"{title}: {finding.text}\n{evidence}  what to do: {finding.remedy}\n\n")
        sys.stdout.flush()
    sys.stdout.write(_summary(found, examination.nodes))
    return found


def _summary(found: list[Finding], nodes: int) -> str:
    errors = sum(finding.level == "error" for finding in found)
    warnings = len(found) - errors
    domain = f"{nodes} {'node' if nodes == 1 else 'nodes'}"
    if not found:
        return f"looked at {domain}: all is well\n"
    return f"looked at {domain}: {_count(errors, 'error')}, {_count(warnings, 'warning')}\n"


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
