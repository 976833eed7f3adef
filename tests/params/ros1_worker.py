"""Runs under the interpreter that ROS 1 is installed for, and does there what it is asked.

Each request is one pickled list on stdin, each answer one on stdout, both behind their length.
"""

# ruff: noqa: ANN001, ANN201, ANN204, BLE001
# mypy: ignore-errors
import contextlib
import io
import pickle
import struct
import sys
import xmlrpc.client

import rosparam
import yaml
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
    """Just the part of the master that rosparam sets parameters through."""

    def __init__(self, params):
        self.params = params

    def setParam(self, key, value):  # noqa: N802
        self.params.set_param(resolve_name(key, CALLER), value)


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
    for pretty in (False, True):
        out = io.StringIO()
        rosparam.get_param = lambda _name: value
        with contextlib.redirect_stdout(out):
            rosparam._rosparam_cmd_get_param("/x", pretty=pretty)
        printed.append(out.getvalue())
    return [yaml.dump(value), *printed]


CALLS = {"history": history, "load": load, "read": read, "show": show}


def main():
    stdin, stdout = sys.stdin.buffer, sys.stdout.buffer
    while True:
        head = stdin.read(4)
        if not head:
            return
        name, *arguments = pickle.loads(stdin.read(struct.unpack("<I", head)[0]))
        body = pickle.dumps(CALLS[name](*arguments), protocol=4)
        stdout.write(struct.pack("<I", len(body)) + body)
        stdout.flush()


if __name__ == "__main__":
    main()
