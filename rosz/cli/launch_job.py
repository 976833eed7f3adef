"""A command line of ``rosz launch``, looked up: what it answers, and how it is carried out."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.cli.launch_files import find_files
from rosz.environment import Environment, package_index

if TYPE_CHECKING:
    from rosz.launch.plan import Plan
    from rosz.launch.run import Options, RouterProcess, Workplace
    from rosz.node.context import Context

__all__ = ("Job",)

_LOOK_SECONDS = 0.1


class Job:
    """A command line, taken apart and looked up.

    Args:
        words: All that is no option.
        keys: Folder of the keys that it and its nodes use, in place of ``ROSZ_KEYS``.
    """

    def __init__(self, words: Sequence[str], keys: Path | None) -> None:
        from rosz.launch.plan import SystemContext, parse_arguments

        self.environ = dict(os.environ)
        if keys is not None:
            self.environ["ROSZ_KEYS"] = str(keys)
        self.cwd = Path.cwd()
        self.environment = Environment.read(self.environ, self.cwd)
        self.packages = package_index(self.environment)
        self.arguments = parse_arguments(words)
        for warning in self.arguments.warnings:
            sys.stderr.write(f"WARNING: {warning}\n")
        self.files = find_files(self.arguments.rest, self.packages)
        self._include_own_package()
        self.context = SystemContext(self.packages, self.environ, self.cwd, _Anonymous())

    def _include_own_package(self) -> None:
        """Have the package that a file lies in found, also where it is not on the path."""
        roots = self.environment.package_roots
        for file in self.files:
            folders = Path(file).absolute().parents if isinstance(file, str) else ()
            own = next((folder for folder in folders if (folder / "package.xml").is_file()), None)
            if own is not None and not any(own.is_relative_to(root) for root in roots):
                roots = (*roots, own)
        if roots != self.environment.package_roots:
            self.environment = msgspec.structs.replace(self.environment, package_roots=roots)
            self.packages = package_index(self.environment)

    @property
    def namespace(self) -> str:
        """The namespace that all nodes are in."""
        return self.arguments.ns or self.environment.namespace

    def plan(self) -> Plan:
        """Return what is to be done.

        Raises:
            RoszError: A file is wrong, or not there.
        """
        from rosz.launch.plan import plan

        return plan(self.files, self.arguments.args, self.context, ns=self.namespace)

    def workplace(self) -> Workplace:
        """Return where commands are made from."""
        from rosz.launch.run import Workplace

        return Workplace(self.packages, self.environment, self.environ, str(self.cwd))

    def answer(self, question: str, node: str) -> str:
        """Return the answer to one of roslaunch's questions."""
        from rosz.launch.plan import describe_args, report

        if question == "ros_args":
            docs = describe_args(self.files, self.arguments.args, self.context, ns=self.namespace)
            return f"{report.describe(docs)}\n"
        plan = self.plan()
        ns = self.namespace or "/"
        if question == "args":
            find = self.workplace().find
            return f"{report.node_args(plan, node, find, self.environ, ns=ns)}\n"
        if question == "find_node":
            return f"{report.node_file(plan, node, ns=ns)}\n"
        if question == "dump_plan":
            return msgspec.json.format(plan.to_json()).decode() + "\n"
        plain = {"nodes": report.list_nodes, "files": report.list_files}
        return f"{plain.get(question, report.dump_params)(plan)}\n"

    def run(self, options: Options, *, wait: bool) -> int:
        """Carry the plan out."""
        from rosz.launch.run import RouterProcess, interrupted_by_signals, needs_router

        plan = self.plan()
        if not needs_router(len(plan.nodes), self.environment, self.environ):
            return self._carry_out(plan, options, wait=wait)
        with interrupted_by_signals(), RouterProcess(self.environment, self.environ) as router:
            self.environment, self.environ = router.environment, router.environ
            return self._carry_out(plan, options, wait=wait, router=router)

    def _carry_out(
        self, plan: Plan, options: Options, *, wait: bool, router: RouterProcess | None = None
    ) -> int:
        from rosz.launch.run import Network, Runner
        from rosz.node.context import Context

        with Context(self.environment) as context:
            if wait:
                _await_others(context)
            runner = Runner(
                plan,
                self.workplace(),
                Network(context, router),
                options,
                out=sys.stdout,
                err=sys.stderr,
            )
            return runner.run()


class _Anonymous:
    """Makes names unique, also when asked twice within a millisecond."""

    def __init__(self) -> None:
        self._count = 0

    def __call__(self, base: str) -> str:
        import socket
        import time

        from rosz import names

        self._count += 1
        moment = time.time_ns() // 1_000_000 + self._count
        return names.anonymous(base, socket.gethostname(), os.getpid(), moment)


def _await_others(context: Context) -> None:
    if not context.session.peers():
        sys.stdout.write("nobody else is there yet; waiting for a core or another launch\n")
        sys.stdout.flush()
    while not context.session.peers():
        time.sleep(_LOOK_SECONDS)
