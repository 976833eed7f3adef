"""rosparam: reads, sets, loads and dumps parameters as YAML (ROS wiki, rosparam)."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import yaml

from rosz.errors import ParamError, YamlError
from rosz.params.yaml import dump, load, load_documents
from rosz.ros1.exceptions import raised_as
from rosz.ros1.state import params_of
from rosz.ros1.tool import Tool
from rosz.ros1.tools.rosgraph.masterapi import Master
from rosz.ros1.tools.rosgraph.names import GLOBALNS, get_ros_namespace, make_global_ns

NAME = "rosparam"
NS = "_ns"


class RosParamException(Exception):
    """A parameter or a parameter file is wrong."""


class RosParamIOException(RosParamException):
    """A file cannot be read or written."""


def get_param_server() -> Master:
    """Return the object with ``getParam``, ``setParam`` and the like."""
    return Master(NAME)


def get_param(param: str) -> Any:
    """Return a parameter, or all parameters in a namespace.

    Raises:
        MasterError: The parameter is not set.
    """
    return get_param_server().getParam(param)


def set_param(param: str, value: str, verbose: bool = False) -> None:
    """Set a parameter from a YAML text; a dict is merged.

    Args:
        param: Name of the parameter.
        value: YAML text.
        verbose: Whether to write each parameter to stdout.

    Raises:
        RosParamException: The text is not YAML, or a parameter cannot have this value.
    """
    with raised_as(RosParamException, YamlError):
        parsed = load(value)
    set_param_raw(param, parsed, verbose)


def set_param_raw(param: str, value: Any, verbose: bool = False) -> None:
    """Set a parameter to a value; a dict is merged, as one change; see `set_param`."""
    _upload(param, value)
    if verbose:
        for name, leaf in _leaves(param, value):
            sys.stdout.write(f"set parameter [{name}] to [{leaf}]\n")


def upload_params(ns: str, values: Any, verbose: bool = False) -> None:
    """Merge a dict into a namespace.

    Args:
        ns: The namespace.
        values: A dict; for other namespaces than the root also a single value.
        verbose: Whether to write each parameter to stdout.

    Raises:
        RosParamException: A parameter cannot have such a value.
    """
    if ns == GLOBALNS and not isinstance(values, dict):
        raise RosParamException("global / can only be set to a dictionary")
    if verbose:
        print_params(values, ns)
    _upload(ns, values)


def _upload(name: str, value: Any) -> None:
    with raised_as(RosParamException, ParamError):
        params_of(get_param_server().caller_id).update(dict(_leaves(name, value)))


def print_params(params: Any, ns: str) -> None:
    """Write names and values to stdout, one per line, or a value that is not a dict alone."""
    if not isinstance(params, dict):
        sys.stdout.write(f"{params}\n")
        return
    for name, value in _leaves(ns, params):
        sys.stdout.write(f"{name}={value}\n")


def _leaves(name: str, value: Any) -> list[tuple[str, Any]]:
    if not isinstance(value, dict):
        return [(name, value)]
    start = name if name.endswith("/") else f"{name}/"
    odd = [key for key in value if not isinstance(key, str)]
    if odd:
        raise RosParamException(
            f"YAML dictionaries must have string keys, got {odd[0]!r}; invalid dictionary is:"
            f"\n{value}"
        )
    return [
        leaf
        for key in value
        for leaf in _leaves(key if key.startswith("/") else start + key, value[key])
    ]


def delete_param(param: str, verbose: bool = False) -> None:
    """Delete a parameter or namespace; the root deletes all parameters.

    Args:
        param: Name of the parameter.
        verbose: Whether to write its name to stdout.

    Raises:
        MasterError: The parameter is not set.
    """
    if param == GLOBALNS:
        get_param_server().setParam(GLOBALNS, {})
    else:
        get_param_server().deleteParam(param)
    if verbose:
        what = "ENTIRE parameter server" if param == GLOBALNS else f"parameter [{param}]"
        sys.stdout.write(f"deleted {what}\n")


def list_params(ns: str) -> list[str]:
    """Return the names of all parameters in a namespace, sorted."""
    space = make_global_ns(ns)
    return sorted(name for name in get_param_server().getParamNames() if name.startswith(space))


def load_str(
    str: str,  # noqa: A002  # ROS 1's
    filename: str,
    default_namespace: str | None = None,
    verbose: bool = False,
) -> list[tuple[Any, str]]:
    """Return the documents of a YAML text, each with its namespace.

    Args:
        str: The text; angles such as ``deg(90)`` are converted.
        filename: File name in errors.
        default_namespace: Namespace of documents without the key ``_ns``.
        verbose: Whether to write the namespaces of documents with the key to stdout.

    Raises:
        YAMLError: The text is not YAML.
    """
    space = default_namespace or get_ros_namespace()
    try:
        documents = load_documents(str, space, filename)
    except YamlError as error:
        # Callers of rosparam catch this error.
        raise yaml.YAMLError(f"{error}") from error
    for name, _ in documents if verbose else ():
        if name != space:
            sys.stdout.write(f"reading parameters into namespace [{name}]\n")
    return [(value, name) for name, value in documents]


def load_file(
    filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[tuple[Any, str]]:
    """Return the documents of a YAML file; see `load_str`.

    Args:
        filename: Path of the file; ``-`` is standard input.
        default_namespace: As for `load_str`.
        verbose: Whether to write the progress to stdout.

    Raises:
        RosParamException: The file does not exist.
    """
    if filename == "-":
        return load_str(sys.stdin.read(), filename, default_namespace, verbose)
    path = Path(filename)
    if not path.is_file():
        raise RosParamException(f"file [{filename}] does not exist")
    if verbose:
        sys.stdout.write(f"reading parameters from [{filename}]\n")
    return load_str(path.read_text("utf-8"), filename, default_namespace, verbose)


def dump_params(filename: str | None, param: str, verbose: bool = False) -> None:
    """Write a parameter or namespace to a file as YAML.

    Args:
        filename: Path of the file; None, an empty text and ``-`` are standard output.
        param: Name of the parameter or namespace.
        verbose: Whether to write the parameters to stdout.

    Raises:
        RosParamIOException: The file cannot be written.
        MasterError: The parameter is not set.
    """
    tree = get_param(param)
    if verbose:
        print_params(tree, param)
    if not filename or filename == "-":
        sys.stdout.write(dump(tree))
        return
    try:
        Path(filename).write_text(dump(tree), encoding="utf-8")
    except OSError as error:
        raise RosParamIOException(f"cannot write [{filename}]: {error.strerror}") from error


_tool = Tool(NAME)
yamlmain = _tool.main
_fullusage = _tool.print_usage
globals().update(_tool.parts("delete list"))
