"""Functions of real roslaunch."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
import xmlrpc.client
from typing import Any


def module(name: str) -> Any:
    """Import a module of ROS, which type checkers do not find."""
    return importlib.import_module(name)


graph_names = module("rosgraph.names")
arg_dump = module("roslaunch.arg_dump")
config_module = module("roslaunch.config")
node_args = module("roslaunch.node_args")
param_dump = module("roslaunch.param_dump")
rlutil = module("roslaunch.rlutil")
unify_clear_params = module("roslaunch.launch")._unify_clear_params
XmlLoader = module("roslaunch.xmlloader").XmlLoader

# The core's own definition costs two processes per file and adds nothing of the file's.
config_module.load_roscore = lambda *_, **__: None

counts: dict[str, int] = {}


def anonymous(base: str) -> str:
    """Return a numbered name, so that both sides have the same ones."""
    counts[base] = counts.get(base, 0) + 1
    return f"{base}_anonymous_{counts[base]}"


graph_names.anonymous_name = anonymous


def printed(function: Any, *args: Any) -> str | None:
    """Return the output of a reporting function, or None if it fails."""
    counts.clear()
    out = io.StringIO()
    try:
        with contextlib.redirect_stdout(out):
            function(*args)
    except SystemExit:
        return None
    except Exception:  # noqa: BLE001  # some reports fail on what the launch itself takes
        return None
    return out.getvalue()


def value(item: Any) -> str:
    """Return a value as text, so that types show."""
    return repr(item.data if hasattr(item, "data") and hasattr(item, "encode") else item)


def process(node: Any) -> dict[str, Any]:
    """Return all properties of a node or test in roslaunch."""
    return {
        "package": node.package,
        "type": node.type,
        "name": node.name,
        "namespace": node.namespace.rstrip("/") or "/",
        "machine": node.machine.name,
        "respawn": node.respawn,
        "respawn_delay": node.respawn_delay,
        "required": node.required,
        "output": node.output or "log",
        "cwd": node.cwd,
        "remaps": [list(pair) for pair in node.remap_args],
        "env": [list(pair) for pair in node.env_args],
        "file": node.filename,
    }


def start(config: Any) -> None:
    """Do what a launch does before any process runs, as far as no master is needed.

    A file that only then turns out to be useless is refused as well, just later.
    """
    for name, param in config.params.items():
        if name == "/":
            raise ValueError("the root takes no scalar")
        with contextlib.suppress(OverflowError):  # a limit of XML-RPC that rosz does not have
            xmlrpc.client.dumps((name, param.value))
    for node in config.nodes + config.tests:
        node.name = node.name or anonymous(node.type)
        with contextlib.suppress(node_args.NodeParamsException):  # reported, no more
            node_args.create_local_process_args(node, node.machine)


def load(question: Any) -> dict[str, Any]:
    """Load the requested files and report on them."""
    os.chdir(question["cwd"])
    for name in question["unset"]:
        os.environ.pop(name, None)
    os.environ.update(question["environ"])
    files = question["files"]
    sys.argv = ["roslaunch", *files, *question["argv"]]
    counts.clear()
    config = config_module.ROSLaunchConfig()
    loader = XmlLoader(resolve_anon=True)
    loader.ignore_unset_args = False
    try:
        for file in files:
            loader.load(file, config, verbose=False)
        config.assign_machines()
    except Exception as error:  # noqa: BLE001  # whatever it is, roslaunch gives up
        return {"error": f"{type(error).__name__}: {error}"}
    names = [graph_names.ns_join(n.namespace, n.name) for n in config.nodes if n.name]
    found = {
        "error": None,
        "params": [[name, value(param.value)] for name, param in config.params.items()],
        "nodes": [process(node) for node in config.nodes],
        "tests": [
            {
                **process(test),
                "test_name": test.test_name,
                "limit": test.time_limit,
                "retry": test.retry,
            }
            for test in config.tests
        ],
        "clear": [name.rstrip("/") or "/" for name in unify_clear_params(config.clear_params)],
        "setup": [[e.command, *e.args] for e in config.executables],
        "machines": sorted(
            [m.name, m.address, m.ssh_port, m.user, m.password, m.timeout, m.assignable]
            for m in config.machines.values()
            if m.name
        ),
        "complaints": config.config_errors,
        "dump": printed(param_dump.dump_params, files),
        "node_list": printed(node_args.print_node_list, files),
        "file_list": printed(rlutil.print_file_list, files),
        "ros_args": printed(arg_dump.dump_args, files),
        "args": {n: printed(node_args.print_node_args, n, files) for n in names},
        "places": {n: printed(node_args.print_node_filename, n, files) for n in names},
    }
    try:
        start(config)
    except Exception as error:  # noqa: BLE001  # whatever it is, roslaunch gives up
        return {"error": f"at the start, {type(error).__name__}: {error}"}
    return found
