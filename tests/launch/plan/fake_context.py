"""A context for launch files that is in memory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from rosz.errors import LaunchError, PackageNotFound
from rosz.launch.plan import LaunchText, Plan, plan


class FakeContext:
    """Files, packages and commands that exist only in a test.

    Args:
        files: Contents by path.
        environ: Environment variables.
    """

    def __init__(
        self, files: Mapping[str, str] | None = None, environ: Mapping[str, str] | None = None
    ) -> None:
        self.files = dict(files or {})
        self.environ: Mapping[str, str] = environ or {}
        self.cwd = "/work"
        self.ran: list[list[str]] = []
        self._counts: Counter[str] = Counter()

    def read(self, path: str) -> bytes:
        if path not in self.files:
            raise FileNotFoundError(2, "No such file or directory", path)
        return self.files[path].encode()

    def find(self, package: str) -> str:
        if package != "robot":
            raise PackageNotFound(package, ["robot"], ["/src"])
        return "/src/robot"

    def built(self, package: str, name: str) -> str | None:
        return f"/devel/lib/{package}/{name}" if name == "driver" else None

    def anonymous(self, base: str) -> str:
        self._counts[base] += 1
        return f"{base}_{self._counts[base]}"

    def run(self, command: Sequence[str]) -> bytes:
        self.ran.append(list(command))
        if command[0] == "fail":
            raise LaunchError("command 'fail' ended with code 3")
        return " ".join(command[1:]).encode()


def plan_of(body: str, outside: FakeContext | None = None, **args: str) -> Plan:
    """Return the plan of ``<launch>`` around some tags, which begin in line 1, column 9."""
    return plan([LaunchText(f"<launch>{body}</launch>", "f")], args, outside or FakeContext())
