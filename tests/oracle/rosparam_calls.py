"""Functions of real rosparam and rosmaster.paramserver."""

# ruff: noqa: ANN001, ANN201, BLE001
# mypy: ignore-errors
import contextlib
import io
import os
import sys
import xmlrpc.client

import rosparam
import yaml
from rosgraph.masterapi import MasterError
from rosgraph.names import resolve_name
from rosmaster.paramserver import ParamDictionary

CALLER = "/rosparam"


def to_ros(value):
    if isinstance(value, bytes):
        return xmlrpc.client.Binary(value)
    if isinstance(value, list):
        return [to_ros(item) for item in value]
    if isinstance(value, dict):
        return {key: to_ros(item) for key, item in value.items()}
    return value


def from_ros(value):
    if isinstance(value, xmlrpc.client.Binary):
        return value.data
    if isinstance(value, list):
        return [from_ros(item) for item in value]
    if isinstance(value, dict):
        return {key: from_ros(item) for key, item in value.items()}
    return value


class Master:
    """The parameters of a master, without the network, in the words of master_api."""

    def __init__(self, params) -> None:
        self.params = params

    def setParam(self, key, value):  # noqa: N802
        try:
            self.params.set_param(resolve_name(key, CALLER), value)
        except TypeError as error:
            raise MasterError(f"Error: invalid arguments: {error}") from error

    def getParam(self, key):  # noqa: N802
        key = resolve_name(key, CALLER)
        try:
            return self.params.get_param(key)
        except KeyError:
            raise MasterError(f"Parameter [{key}] is not set") from None

    def deleteParam(self, key):  # noqa: N802
        key = resolve_name(key, CALLER)
        try:
            self.params.delete_param(key)
        except KeyError:
            raise MasterError(f"parameter [{key}] is not set") from None

    def getParamNames(self):  # noqa: N802
        return self.params.get_param_names()


def history(steps):
    params = ParamDictionary(None)
    results = []
    for step, name, value in steps:
        try:
            if step == "set":
                results.append(params.set_param(name, to_ros(value)))
            elif step == "delete":
                results.append(params.delete_param(name))
            elif step == "get":
                results.append(from_ros(params.get_param(name)))
            elif step == "search":
                results.append(params.search_param(value, name))
        except Exception as error:
            results.append(error.__class__.__name__)
    return results, from_ros(params.get_param("/")), sorted(params.get_param_names())


def load(start, text, namespace):
    """Do what `rosparam load` does to a tree."""
    params = ParamDictionary(None)
    params.set_param("/", start)
    rosparam.get_param_server = lambda: Master(params)
    try:
        for values, space in rosparam.load_str(text, "file", default_namespace=namespace):
            rosparam.upload_params(space, values)
    except Exception as error:
        return error.__class__.__name__, None
    return None, from_ros(params.get_param("/"))


def read(text):
    try:
        return None, [from_ros(value) for value in yaml.safe_load_all(text)]
    except Exception as error:
        return error.__class__.__name__, None


def show(value):
    """Return what `rosparam dump`, `get` and `get -p` print of a value."""
    printed = []
    original = rosparam.get_param
    rosparam.get_param = lambda _name: value
    try:
        for pretty in (False, True):
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                rosparam._rosparam_cmd_get_param("/x", pretty=pretty)
            printed.append(out.getvalue())
    finally:
        rosparam.get_param = original
    return [yaml.dump(value), *printed]


def commands(lines, stdin, folder):
    """Run rosparam command lines; return exit code, stdout and stderr of each."""
    params = ParamDictionary(None)
    rosparam.get_param_server = lambda: Master(params)
    os.chdir(folder)
    os.environ.pop("ROS_NAMESPACE", None)
    answers = []
    for words in lines:
        sys.stdin = io.StringIO(stdin)
        out, err = io.StringIO(), io.StringIO()
        code = 0
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                rosparam.yamlmain(["rosparam", *words])
            except SystemExit as end:
                code = end.code or 0
            except Exception as error:
                code = 1
                err.write(f"{error.__class__.__name__}: {error}")
        answers.append((code, out.getvalue(), err.getvalue()))
    return answers
