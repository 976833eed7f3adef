"""A launch as a process of its own: ``program.py FOLDER PLAN.json [OPTIONS.json [PACKAGES]]``."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from rosz.environment import Environment
from rosz.errors import ParamNotFound
from rosz.launch.plan.model import Condition, Plan
from rosz.launch.run import Network, Options, Runner, Workplace
from rosz.packages import PackageIndex


class NoNetwork(Network):
    """Parameters that are written and never read, and conditions that are never true."""

    def __init__(self) -> None:
        self.session = None
        self.domain = 0
        self.alone = True
        self.router = None

    def get(self, name: str) -> Any:
        raise ParamNotFound(name)

    def has(self, name: str) -> bool:
        return not name

    def write(self, values: Mapping[str, Any], deleted: Iterable[str] = ()) -> None:
        del values, deleted

    def dump(self, name: str) -> str:
        return name

    def holds(self, condition: Condition) -> bool:
        return not str(condition)


def main() -> int:
    folder = Path(sys.argv[1])
    plan = msgspec.json.decode(Path(sys.argv[2]).read_bytes(), type=Plan)
    options = msgspec.json.decode(sys.argv[3].encode() if sys.argv[3:] else b"{}", type=Options)
    environment = Environment(home=folder / "home", log_dir=folder / "log")
    packages = PackageIndex([Path(root) for root in sys.argv[4:]])
    workplace = Workplace(packages, environment, dict(os.environ), str(folder))
    network = NoNetwork()
    return Runner(plan, workplace, network, options, out=sys.stdout, err=sys.stderr).run()


if __name__ == "__main__":
    sys.exit(main())
