"""Packages of ROS 2 to begin with, as its ``pkg create`` creates them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import escape

import msgspec

from rosz.errors import LaunchError, UsageError
from rosz.names import is_valid
from rosz.workspace.creation import fill_template

LICENSES = (
    "Apache-2.0",
    "BSL-1.0",
    "BSD-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "GPL-3.0-only",
    "LGPL-2.1-only",
    "LGPL-3.0-only",
    "MIT",
    "MIT-0",
)
"""The licenses that get a file of their own, by their names in SPDX."""


class AmentPackage(msgspec.Struct, frozen=True, kw_only=True):
    """A package of ROS 2 that is to be created.

    Attributes:
        name: Name of the package.
        parent: Folder to create it in.
        build_type: ``ament_python``, ``ament_cmake`` or ``cmake``.
        dependencies: Names of packages that it needs.
        description: Description for package.xml.
        license: License for package.xml.
        maintainer: Name of the maintainer.
        email: Address of the maintainer; one of nobody if empty.
        manifest_format: Format of package.xml.
        node: Name of a program to begin with; none if empty.
        library: Name of a library to begin with; none if empty.
    """

    name: str
    parent: Path
    build_type: str
    dependencies: tuple[str, ...]
    description: str
    license: str
    maintainer: str
    email: str
    manifest_format: int = 3
    node: str = ""
    library: str = ""

    @property
    def folder(self) -> Path:
        """The folder of the package."""
        return self.parent / self.name

    def create(self) -> Iterator[str]:
        """Create the folders and files, and yield what is created, as ROS 2 says it.

        Raises:
            UsageError: The name is not valid.
            LaunchError: A file cannot be written.
        """
        if not is_valid(self.name) or not self.name.isidentifier():
            raise UsageError(f"'{self.name}' is not a valid package name")
        if self.library and self.build_type != "ament_python":
            raise UsageError("only a library in Python is created: use --build-type ament_python")
        folder = f"{self.parent}/{self.name}" if str(self.parent) != "." else f"./{self.name}"
        made: set[str] = set()
        for path, text in self._files():
            above, _, base = path.rpartition("/")
            if above not in made:
                made.add(above)
                yield f"creating folder {folder}{'/' * bool(above)}{above}"
            try:
                (self.folder / above).mkdir(parents=True, exist_ok=True)
                if base:
                    (self.folder / path).write_text(text, encoding="utf-8")
            except OSError as error:
                raise LaunchError(f"cannot create '{error.filename}': {error.strerror}") from error
            if base:
                yield f"creating {folder}/{path}"
            if path == "package.xml":
                python = self.build_type == "ament_python"
                yield f"creating source {'' if python else 'and include '}folder"
        if self.license in LICENSES:
            text = f"{self.license}: https://spdx.org/licenses/{self.license}.html\n"
            (self.folder / "LICENSE").write_text(text)

    def _files(self) -> Iterator[tuple[str, str]]:
        """Yield the paths in the package with their texts; a path that ends in / is a folder."""
        yield "package.xml", self._manifest()
        yield from self._python() if self.build_type == "ament_python" else self._cpp()

    def _python(self) -> Iterator[tuple[str, str]]:
        entry = f'            "{self.node} = {self.name}.{self.node}:main",\n' if self.node else ""
        fields = msgspec.structs.asdict(self) | {"email": self._address}
        yield f"{self.name}/", ""
        yield "setup.py", fill_template("ament_setup.py", **fields, scripts=entry)
        yield "setup.cfg", fill_template("ament_setup.cfg", name=self.name)
        yield f"resource/{self.name}", ""
        yield f"{self.name}/__init__.py", ""
        for linter in ("copyright", "flake8", "pep257"):
            yield f"test/test_{linter}.py", fill_template("ament_lint.py", linter=linter)
        if self.node:
            yield f"{self.name}/{self.node}.py", fill_template("ament_node.py", name=self.name)
        if self.library:
            yield f"{self.name}/{self.library}/__init__.py", ""

    def _cpp(self) -> Iterator[tuple[str, str]]:
        yield "src/", ""
        yield f"include/{self.name}/", ""
        yield "CMakeLists.txt", self._cmake()
        if self.node:
            yield f"src/{self.node}.cpp", fill_template("ament_node.cpp", name=self.name)

    def _cmake(self) -> str:
        ament = self.build_type == "ament_cmake"
        needed = "".join(f"find_package({each} REQUIRED)\n" for each in self.dependencies)
        program = ""
        if self.node:
            program = (
                f"\nadd_executable({self.node} src/{self.node}.cpp)\n"
                f"install(TARGETS {self.node} DESTINATION lib/${{PROJECT_NAME}})\n"
            )
        return fill_template(
            "ament_CMakeLists.txt",
            name=self.name,
            buildtool="find_package(ament_cmake REQUIRED)\n" if ament else "",
            dependencies=needed,
            program=program,
            end="\nament_package()\n" if ament else "",
        )

    @property
    def _address(self) -> str:
        return self.email or f"{self.maintainer}@todo.todo"

    def _manifest(self) -> str:
        tests: tuple[str, ...] = ()
        tags: list[tuple[str, str]] = []
        if self.build_type == "ament_cmake":
            tests = ("ament_lint_auto", "ament_lint_common")
            tags = [("buildtool_depend", "ament_cmake")]
        elif self.build_type == "ament_python":
            tests = ("ament_copyright", "ament_flake8", "ament_pep257", "python3-pytest")
        tags += [("depend", name) for name in self.dependencies]
        tags += [("test_depend", name) for name in tests]
        lines = "".join(f"  <{tag}>{escape(name)}</{tag}>\n" for tag, name in tags)
        maintainer = escape(self.maintainer)
        return (
            '<?xml version="1.0"?>\n'
            f'<package format="{self.manifest_format}">\n'
            f"  <name>{self.name}</name>\n"
            "  <version>0.0.0</version>\n"
            f"  <description>{escape(self.description)}</description>\n"
            f'  <maintainer email="{escape(self._address)}">{maintainer}</maintainer>\n'
            f"  <license>{escape(self.license)}</license>\n\n"
            f"{lines}\n"
            f"  <export>\n    <build_type>{self.build_type}</build_type>\n  </export>\n"
            "</package>\n"
        )

    def announcement(self) -> list[str]:
        """Return the lines that tell what is created, as ROS 2 prints them."""
        lines = {
            "package name": self.name,
            "destination directory": self.parent.absolute(),
            "package format": self.manifest_format,
            "version": "0.0.0",
            "description": self.description,
            "maintainer": [f"{self.maintainer} <{self._address}>"],
            "licenses": [self.license],
            "build type": self.build_type,
            "dependencies": [*self.dependencies],
        }
        lines |= {"node_name": self.node} if self.node else {}
        lines |= {"library_name": self.library} if self.library else {}
        return ["going to create a new package", *(f"{k}: {v}" for k, v in lines.items())]
