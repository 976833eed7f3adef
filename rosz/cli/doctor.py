"""``rosz doctor``: find problems, as roswtf does."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from rosz.cli.console import count, paint, print_json, print_lines, takes_escapes
from rosz.cli.declare import App, Json, Option, seconds

if TYPE_CHECKING:
    from rosz.doctor import Examination, Finding

__all__ = ("app",)

app = App()


@app.command()
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
            title = paint(title, finding.level)
        evidence = "".join(f"  - {line}\n" for line in listed(finding.evidence))
        print_lines([f"{title}: {finding.text}\n{evidence}  what to do: {finding.remedy}\n"])
    errors = sum(finding.level == "error" for finding in found)
    counts = f"{count(errors, 'error')}, {count(len(found) - errors, 'warning')}"
    verdict = counts if found else "all is well"
    print_lines([f"looked at {count(examination.nodes, 'node')}: {verdict}"])
    return found
