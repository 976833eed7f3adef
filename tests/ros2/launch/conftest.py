"""Launch files of ROS 2, read in a folder of the test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

from rosz.errors import LaunchFileError
from rosz.launch.plan import ArgDoc, NodePlan, Plan, SystemContext
from rosz.packages import PackageIndex
from rosz.ros1 import importer

HEAD = """\
from launch import LaunchDescription
from launch.actions import *
from launch.conditions import *
from launch.substitutions import *
from launch.launch_description_sources import *
from launch_ros.actions import *
from launch_ros.descriptions import *
from launch_ros.substitutions import *

def generate_launch_description():
    return LaunchDescription([
"""


class Folder:
    """A folder of launch files, which is also the package ``robot``."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.write("package.xml", "<package><name>robot</name></package>")

    def write(self, name: str, text: str) -> str:
        file = self.path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(dedent(text))
        return str(file)

    def context(self, **environ: str) -> SystemContext:
        return SystemContext(
            PackageIndex([self.path]), environ, self.path, lambda base: f"{base}_1"
        )

    def read(
        self, file: str, *, ns: str = "", environ: dict[str, str] | None = None, **args: str
    ) -> Plan:
        from rosz.ros2.launch.source import plan

        return plan([file], args, self.context(**(environ or {})), ns=ns)

    def plan(self, entities: str, *, head: str = "", **options: Any) -> Plan:
        """Return the plan of a file with these entities."""
        text = f"{head}{HEAD}{entities}\n    ])\n"
        return self.read(self.write("x.launch.py", text), **options)

    def node(self, entities: str, **options: Any) -> NodePlan:
        (node,) = self.plan(entities, **options).nodes
        return node

    def error(self, entities: str, *, head: str = "", **options: Any) -> str:
        """Return the error of a file with these entities; lines count from the first of them."""
        with pytest.raises(LaunchFileError) as caught:
            self.plan(entities, head=head, **options)
        line = caught.value.line - (head + HEAD).count("\n")
        assert caught.value.path == str(self.path / "x.launch.py")
        return f"{line}: {caught.value.plain_reason}"

    def args(self, entities: str) -> tuple[ArgDoc, ...]:
        from rosz.ros2.launch.source import describe_args

        file = self.write("x.launch.py", f"{HEAD}{entities}\n    ])\n")
        return describe_args([file], {}, self.context())


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Folder]:
    """Return a folder in which ``launch`` can be imported."""
    importer.install()
    yield Folder(tmp_path)
    importer.uninstall()
