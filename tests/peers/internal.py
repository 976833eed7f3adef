"""Tests of public suites that check what is internal to ROS 1's packages, each with the reason.

Such a test calls functions that no program calls, or checks what a design without a master has not.
"""

from __future__ import annotations

from fnmatch import fnmatch
from pathlib import Path

__all__ = ("INTERNAL", "reason")

_TCPROS = "TCPROS sockets and headers; rosz has no TCP connections of its own"
_XMLRPC = "XML-RPC servers and the node's registration with a master; rosz has neither"

_LAUNCH = "roslaunch's XML-RPC between launches, and its threads; a launch here has one loop"

INTERNAL = {
    ("test_nodeprocess.py", "*"): _LAUNCH,
    ("test_roslaunch_child.py", "*"): _LAUNCH,
    ("test_roslaunch_launch.py", "*"): _LAUNCH,
    ("test_roslaunch_parent.py", "*"): "replaces the insides of roslaunch's parent by mocks",
    ("test_roslaunch_pmon.py", "*"): _LAUNCH,
    ("test_roslaunch_remote.py", "*"): _LAUNCH,
    ("test_roslaunch_server.py", "*"): _LAUNCH,
    ("test_roslaunch_depends.py", "*"): "what catkin's roslaunch_add_file_check calls in builds",
    ("test_substitution_args.py", "*test__arg"): "the function behind one of the substitutions",
    ("test_rospy_tcpros*.py", "*"): _TCPROS,
    ("test_rospy_transport.py", "*"): _TCPROS,
    ("test_rospy_registration.py", "*"): _XMLRPC,
    ("test_rospy_paramserver.py", "*"): "rospy's cache of parameters; every process has a replica",
    ("test_rospy_validators.py", "*"): "validators of XML-RPC arguments",
    ("test_node_api.py", "*"): _XMLRPC,
    ("test_xmlrpc.py", "*"): _XMLRPC,
}
"""Reasons, by patterns of file names and of test names."""


def reason(file: Path, test: str) -> str:
    """Return why a test is left out, or an empty text."""
    for (name, pattern), text in INTERNAL.items():
        if fnmatch(file.name, name) and fnmatch(test, pattern):
            return text
    return ""
