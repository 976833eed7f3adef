"""Programs, launches, and what is asked about the whole system."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from rosz.cli.console import print_error, print_lines
from rosz.cli.ros2.graph import CommandFailed, read_view
from rosz.cli.ros2.packages import find_package
from rosz.environment import Environment, package_index
from rosz.errors import ExecutableNotFound, NotFoundError

_STANDARD = ("/parameter_events", "/rosout")


def run(given: Namespace) -> int | str:
    """Run a program of a package."""
    from rosz.launch.run import Workplace
    from rosz.launch.run import run_command as make_command

    if find_package(given.package) is None:
        raise CommandFailed(f"Package '{given.package}' not found")
    environ = dict(os.environ)
    environment = Environment.read(environ)
    place = Workplace(package_index(environment), environment, environ, str(Path.cwd()))
    prefix = given.prefix or ""
    try:
        made = make_command(place, given.package, given.executable_name, given.argv, prefix)
    except ExecutableNotFound as error:
        print_error(str(error))
        return "No executable found"
    process = subprocess.Popen(made.argv, env=made.environ)
    signal.signal(signal.SIGTERM, lambda number, _: process.send_signal(number))
    while True:
        try:
            code = process.wait()
            break
        except KeyboardInterrupt:  # the program has got it, too
            continue
    if code:
        failure = f"Process exited with failure {code}"
        print_lines([f"[ros2run]: {failure if code > 0 else signal.strsignal(-code)}"])
    return code


def launch(given: Namespace) -> int:
    """Start the nodes of a launch file."""
    from rosz.cli.launch import LaunchOptions, launch_command

    words = [given.launch_file_name, *given.launch_arguments]
    words = [word for word in words if word is not None]
    if Path(given.package).is_file():
        file, arguments = given.package, words
    else:
        file, arguments = _file_of(given.package, given.launch_file_name), words[1:]
    for word in arguments:
        if not word.partition(":=")[0] or not word.partition(":=")[2]:
            raise CommandFailed(
                f"malformed launch argument '{word}', expected format '<name>:=<value>'"
            )
    if given.show_args:
        _show_arguments(file)
        return 0
    screen, verbose = given.show_all_subprocesses_output, given.debug
    options = LaunchOptions(dump_plan=given.print, screen=screen, verbose=verbose)
    return launch_command(options, [file, *arguments])


def _file_of(name: str, file: str | None) -> str:
    package = find_package(name)
    if package is None:
        raise CommandFailed(f"Package '{name}' not found: there is none of that name")
    files = package.files(file) if file else []
    place = f"in the share directory of package '{name}'"
    if not files:
        raise CommandFailed(f"file '{file}' was not found {place} which is at '{package.path}'")
    if len(files) > 1:
        listed = ", ".join(f"'{each}'" for each in files)
        raise CommandFailed(f"file '{file}' was found more than once {place}: [{listed}]")
    return str(files[0])


def _show_arguments(file: str) -> None:
    from rosz.cli.launch import reader_of
    from rosz.launch.plan import SystemContext

    environment = Environment.read()
    packages = package_index(environment)
    context = SystemContext(packages, dict(os.environ), Path.cwd(), lambda base: base)
    lines = ["Arguments (pass arguments as '<name>:=<value>'):"]
    documents = reader_of([file]).describe_args([file], {}, context)
    for each in documents:
        lines += ["", f"    '{each.name}':", f"        {each.doc or 'no description given'}"]
        if each.default is not None:
            lines.append(f"        (default: '{each.default}')")
    print_lines(lines if documents else [*lines, "", "  No arguments."])


def doctor(given: Namespace) -> None:
    """Look for faults, and print what is there."""
    from rosz.doctor import Examination, examine

    if given.report:
        _report()
        return
    findings = list(examine(Examination(environment=Environment.read())))
    for each in findings:
        level = "ERROR: " if each.level == "error" else ""
        print_error(f"UserWarning: {level}{each.text}")
    faults = [each for each in findings if each.level == "error" or given.include_warnings]
    names = sorted({each.name for each in faults})
    if not names:
        print_lines(["\nAll checks passed\n"])
        return
    print_lines([f"\n{len(names)} check(s) failed\n", f"Failed modules: {' '.join(names)}"])
    if given.report_failed:
        _report()


def _report() -> None:
    import platform

    view, environment = read_view(), Environment.read()
    topics: list[tuple[str, object]] = []
    for name in view.topics():
        if name not in _STANDARD:
            topics += [
                ("topic", name),
                ("publisher count", len(view.publishers(name))),
                ("subscriber count", len(view.subscriptions(name))),
            ]
    sections: dict[str, Sequence[tuple[str, object]]] = {
        "PLATFORM INFORMATION": [
            ("system", platform.system()),
            ("platform info", platform.platform()),
            ("release", platform.release()),
            ("processor", platform.processor()),
            ("python", sys.version.split()[0]),
        ],
        "RMW MIDDLEWARE": [("middleware name", "rmw_zenoh_cpp")],
        "ROS 2 INFORMATION": [
            ("distribution name", environment.distro or "rosz"),
            ("domain", environment.domain),
        ],
        "TOPIC LIST": topics or [("topic", "none")],
    }
    for title, pairs in sections.items():
        longest = max(len(name) for name, _ in pairs)
        width = longest + 4 if longest >= 8 else 8  # noqa: PLR2004  # as ROS 2's
        print_lines([f"\n   {title}", *(f"{name:<{width}}: {value}" for name, value in pairs)])


def daemon_status(_: Namespace) -> None:
    """Print that the daemon is not running. rosz has none."""
    print_lines(["The daemon is not running"])


stop_daemon = daemon_status


def start_daemon(_: Namespace) -> None:
    """Print that rosz needs no daemon."""
    print_error("rosz has no daemon: its commands query the nodes directly")


def multicast(_: Namespace) -> None:
    """Refuse to use multicast."""
    raise NotFoundError(
        "rosz sends no multicast packets: nodes meet at an endpoint, which 'rosz doctor' checks"
    )
