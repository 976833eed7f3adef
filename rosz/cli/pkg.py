"""``rosz pkg``: list, find, create and check packages."""

from __future__ import annotations

import itertools
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rosz.cli import suggest
from rosz.cli.console import (
    count,
    paint,
    print_error,
    print_json,
    print_lines,
    print_result,
    takes_escapes,
    warn,
)
from rosz.cli.declare import App, Argument, Json, Option
from rosz.environment import Environment, package_index
from rosz.errors import NotFoundError

if TYPE_CHECKING:
    from rosz.packages import Package, PackageIndex
    from rosz.workspace import Checked, Migration, Problem

app = App("List, find, create and check packages.")


_BUILT_IN = frozenset(
    {"catkin", "message_generation", "message_runtime", "roslib", "rospy", "roscpp"}
)
"""Dependencies of ROS 1 packages that rosz provides, though not as packages."""
_CATKIN_TARGETS = frozenset({"all", "clean", "install", "run_tests", "tests", "test"})

_SHOWN = 6
"""Names in a line that lists who needs something."""


@app.command("list")
def list_packages(
    *,
    names: Annotated[bool, Option("--names -n", "Print only the names.")] = False,
    json: Json = False,
) -> None:
    """List all packages with their folders."""
    index = _index()
    packages = index.packages()
    for fault in index.broken:
        warn(str(fault))
    lines = (package.name if names else f"{package.name} {package.path}" for package in packages)
    print_result(lines, {package.name: str(package.path) for package in packages}, as_json=json)


@app.command("find")
def find_package(
    name: Annotated[str, Argument("PACKAGE", "The workspace if omitted.", suggest.packages)] = "",
    *,
    json: Json = False,
) -> None:
    """Print the folder of a package."""
    package = _index().find(name) if name else _workspace()
    path = str(package.path)
    print_result([path], {"name": package.name, "path": path}, as_json=json)


@app.command("create")
def create_package(
    name: Annotated[str, Argument("NAME")],
    dependencies: Annotated[
        list[str] | None, Argument("DEPENDENCY", source=suggest.packages)
    ] = None,
    *,
    description: Annotated[str, Option("--description -d TEXT", "The package's description.")] = "",
    maintainer: Annotated[str, Option("--maintainer -m NAME", "Name of the maintainer.")] = "",
    license_name: Annotated[str, Option("--license -l NAME", "Name of the license.")] = "",
    bare: Annotated[bool, Option("--bare", "Create only what catkin_create_pkg creates.")] = False,
) -> None:
    """Create a package in the working folder, with a message, a talker and a launch file."""
    from rosz.workspace import create

    made = create(
        Path.cwd(),
        name,
        dependencies or [],
        bare=bare,
        description=description,
        maintainer=maintainer,
        license_name=license_name,
    )
    if bare:  # in the words of catkin_create_pkg
        for path in made:
            kind = "folder" if path.is_dir() else "file"
            print_lines([f"Created {kind} {path.relative_to(Path.cwd())}"])
        where = made[0].parent
        print_lines(
            [f"Successfully created files in {where}. Please adjust the values in package.xml."]
        )
    index = _index()
    for dependency in dependencies or []:
        if dependency not in index.names() and dependency not in _BUILT_IN:
            warn(f"dependency '{dependency}' is not on the package path")
    if not bare:
        file = made[0].parent / "launch" / "talker.launch"
        print_lines([f"created {made[0].parent}", f"run it with: rosz launch {file}"])


def _workspace() -> Package:
    """Return the first folder of the package path, where ``roscd`` alone goes."""
    from rosz.packages import Package

    for root in Environment.read().package_roots:
        path = root.parent if root.name == "src" else root
        return Package(path.name, path)
    raise NotFoundError(
        "no workspace: ROSZ_PACKAGE_PATH is not set, and no folder 'src' or package.xml is here or"
        " above"
    )


def _index() -> PackageIndex:
    return package_index(Environment.read())


@app.command("check", tolerant=True)
def check_command(
    words: Annotated[
        list[str] | None,
        Argument(
            "FOLDER|PACKAGE",
            "The workspace of this folder if omitted.",
            suggest.packages_and_folders,
        ),
    ] = None,
    *,
    setup: Annotated[
        bool, Option("--setup", "Write devel/setup.bash and the like, as catkin_make does.")
    ] = False,
    migrate: Annotated[
        bool, Option("--migrate", "Tell on one page what runs here, and what else is needed.")
    ] = False,
    json: Json = False,
) -> int:
    """Check packages: manifest, definitions, launch files, .cfg files and scripts.

    The exit code is 1 if there is an error; with --migrate, if something does not run here.
    With --setup, catkin builds packages with C++ programs (rosz help cpp). Options and targets of
    catkin_make are ignored otherwise.
    """
    from rosz.workspace import check, editor_folder, find_packages, is_compiled, write_stubs

    cwd = Path.cwd()
    environment = Environment.read()
    targets = _without_options(words or (), cwd)
    folders = find_packages(targets, cwd, package_index(environment))
    compiled, unbuilt = any(map(is_compiled, folders)), False
    if setup and compiled:
        try:
            if code := _build([word for word in words or () if word not in targets], cwd):
                return code
        except NotFoundError as error:  # programs in Python need no catkin
            print_error(f"ERROR: {error}")
            unbuilt = True
    done = check(folders, environment, os.environ)
    if migrate:
        return _print_migration(folders, environment, _follow(done, len(folders)), as_json=json)
    if json:
        checked = list(done)
        print_json(checked)
    else:
        checked = _print_checked(
            done, len(folders), cwd, colored=environment.color, compiled=compiled
        )
    if editor_folder(environment).is_dir():  # 'rosz env --editor' has written it once
        write_stubs(environment)
    if setup:
        file = _write_setup(cwd, replace=compiled)
        sys.stdout.write(f"in a new shell: source {_shorten(str(file), cwd)}\n")
    wrong = any(problem.level == "error" for each in checked for problem in each.problems)
    return int(wrong or unbuilt)


def _without_options(words: Sequence[str], cwd: Path) -> list[str]:
    """Leave out the words that tell catkin_make how to build."""
    targets: list[str] = []
    before = ""
    for word in words:
        counts = before in {"-j", "-l"} and word.isdecimal()
        target = word in _CATKIN_TARGETS and not (cwd / word).is_dir()
        if not word.startswith("-") and not counts and not target:
            targets.append(word)
        before = word
    return targets


def _follow(done: Iterable[Checked], total: int) -> list[Checked]:
    """Return the checked packages; a terminal shows the progress."""
    terminal = takes_escapes(sys.stderr)
    checked: list[Checked] = []
    for each in done:
        checked.append(each)
        if terminal:
            sys.stderr.write(f"\r\033[K[{100 * len(checked) // total:3d}%] {each.name}")
            sys.stderr.flush()
    if terminal:
        sys.stderr.write("\r\033[K")
    return checked


def _print_checked(
    done: Iterable[Checked], total: int, cwd: Path, *, colored: bool, compiled: bool
) -> list[Checked]:
    """Print errors, warnings, packages that are not there, and a summary.

    A text of several places is printed once.
    """
    checked = _follow(done, total)
    colored = colored and takes_escapes(sys.stdout)
    problems = {problem for each in checked for problem in each.problems}
    plain = [problem for problem in problems if not problem.missing]
    places: dict[tuple[str, str], list[Problem]] = {}
    for problem in sorted(plain, key=lambda problem: (problem.level, problem)):
        places.setdefault((problem.level, problem.text), []).append(problem)
    for same in places.values():
        sys.stdout.write(_format_problem(same, cwd, colored=colored))
    absent = _absent(checked)
    print_lines(absent)
    errors = sum(problem.level == "error" for problem in problems)
    counts = f"{count(errors, 'error')}, {count(len(plain) - errors, 'warning')}"
    more = f", {count(len(absent), 'package')} not there" if absent else ""
    verdict = "" if errors or absent or compiled else "; nothing needs building"
    sys.stdout.write(f"checked {count(len(checked), 'package')}: {counts}{more}{verdict}\n")
    return checked


def _absent(checked: Iterable[Checked]) -> list[str]:
    """Return a line for each package that is not there, with those that need it."""
    from rosz.replacements import instead_of

    needed: dict[str, dict[str, None]] = {}
    for each in checked:
        for problem in each.problems:
            if problem.missing:
                needed.setdefault(problem.missing, {})[each.name] = None
    lines: list[str] = []
    for name, users in sorted(needed.items()):
        instead = instead_of(name)
        lines.append(
            f"package '{name}' is not there; needed by {_listed(list(users))}"
            + (f": {instead}" if instead else "")
        )
    return lines


def _listed(names: Sequence[str]) -> str:
    """Return the first names, and how many there are more."""
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more


def _print_migration(
    folders: Sequence[Path], environment: Environment, checked: Sequence[Checked], *, as_json: bool
) -> int:
    """Print which programs of packages run here; return 0 if all of them do."""
    from rosz.workspace import migrate

    errors = {
        each.name: number
        for each in checked
        if (
            number := sum(
                problem.level == "error" and "Python 2" not in problem.text
                for problem in each.problems
            )
        )
    }
    page = migrate(folders, environment, errors)
    print_result([*_page(page, Path.cwd()), *_absent(checked)], page, as_json=as_json)
    return int(not page.runs)


def _page(page: Migration, cwd: Path) -> Iterator[str]:
    programs = page.programs
    good = sum(program.runs for program in programs)
    yield f"{count(page.packages, 'package')}, {count(len(programs), 'Python program')}"
    yield f"runs here as it is: {good} of {len(programs)}"
    yield from _needs(programs, "needs pip install", "install")
    yield from _needs(programs, "needs a module that is not there", "missing")
    yield from _python2(programs, cwd)
    compiled = sum(map(len, page.compiled.values()))
    yield f"is C++: {compiled}" + (
        "; catkin builds it (rosz help cpp), or it becomes a node of ROS 2 beside rosz"
        if compiled
        else ""
    )
    yield from (f"    {name}: {_listed(names)}" for name, names in sorted(page.compiled.items()))
    mistakes = sum(page.errors.values())
    yield f"other mistakes: {mistakes}" + ("; 'rosz pkg check' lists them" if mistakes else "")
    yield from (f"    {name}: {number}" for name, number in sorted(page.errors.items()))


def _needs(programs: Iterable[Any], title: str, attribute: str) -> Iterator[str]:
    """Yield how many programs need something that is not there, and who needs each thing."""
    needs: dict[str, dict[str, None]] = {}
    for program in programs:
        for need in getattr(program, attribute):
            needs.setdefault(need, {})[f"{program.package}/{Path(program.path).name}"] = None
    yield f"{title}: {len({name for users in needs.values() for name in users})}"
    for need, users in sorted(needs.items(), key=lambda item: (-len(item[1]), item[0])):
        yield f"    {need}: {_listed(list(users))}"


def _python2(programs: Iterable[Any], cwd: Path) -> Iterator[str]:
    """Yield how many programs are Python 2, and the lines that show it."""
    places = [program.python2 for program in programs if program.python2]
    old: dict[str, dict[str, str]] = {}
    for place in itertools.chain.from_iterable(places):
        file, line, what = place.split(":", 2)
        old.setdefault(_shorten(file, cwd), {})[line] = what.strip()
    yield f"is Python 2: {len(places)}" + ("; convert with: 2to3 -w FILE" if old else "")
    for file, lines in old.items():
        numbers = ", ".join(sorted(lines, key=int))
        yield f"    {file}: line {numbers}: {'; '.join(dict.fromkeys(lines.values()))}"


def _format_problem(same: Sequence[Problem], cwd: Path, *, colored: bool) -> str:
    problem = same[0]
    level = paint(problem.level, problem.level) if colored else problem.level
    more = f" ({count(len(same), 'place')} like this)" if len(same) > 1 else ""
    return f"{_shorten(problem.place, cwd)}: {level}: {problem.text}{more}\n"


def _shorten(place: str, cwd: Path) -> str:
    return place.removeprefix(f"{cwd}/")


def _build(words: Sequence[str], cwd: Path) -> int:
    """Build the C++ programs of the workspace, and return the exit code."""
    from rosz.workspace import build

    sys.stdout.flush()
    code = build(_workspace_around(cwd), words, os.environ)
    if code:
        _write_setup(cwd, replace=True)
    return int(bool(code))


def _workspace_around(cwd: Path) -> Path:
    for folder in (cwd, *cwd.parents):
        if (folder / "src").is_dir():
            return folder
    raise NotFoundError(f"no workspace around {cwd}: expected a folder 'src' with packages")


def _write_setup(cwd: Path, *, replace: bool) -> Path:
    """Write the files that course documents source after catkin_make; return the first one."""
    import shlex

    from rosz.cli.env import SHELLS
    from rosz.workspace import write_setup

    workspace = _workspace_around(cwd)
    lines: dict[str, str] = {}
    for shell in SHELLS:
        command = f"{shlex.quote(sys.executable)} -P -m rosz env {shell}"
        lines[shell] = f"{command} | source\n" if shell == "fish" else f'eval "$({command})"\n'
    return write_setup(workspace, lines, replace=replace)[0]
