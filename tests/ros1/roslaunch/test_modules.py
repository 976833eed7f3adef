"""The smaller modules of roslib, rosgraph and rospkg, compared with ROS 1's."""

from __future__ import annotations

import pytest
from oracle import same

pytestmark = pytest.mark.ros1

ROSGRAPH = """
import os, tempfile, logging
from rosgraph import network, roslogging
header = {"callerid": "/a", "type": "std_msgs/String"}
with tempfile.TemporaryDirectory() as folder:
    file = roslogging.configure_logging("me", filename="a.log", env={"ROS_LOG_DIR": folder + "/x"})
    logging.getLogger("part").warning("said")
    with open(file) as opened:
        text = opened.read()
    for handler in logging.getLogger().handlers[:]:
        if getattr(handler, "baseFilename", "") == file:
            logging.getLogger().removeHandler(handler)
            handler.close()
    made = [os.path.relpath(file, folder), "said" in text, roslogging.renew_latest_logdir(folder)]
result = [
    made, network.encode_ros_handshake_header(header) ==
    b"\\x2b\\0\\0\\0\\x0b\\0\\0\\0callerid=/a\\x14\\0\\0\\0type=std_msgs/String",
    network.decode_ros_handshake_header(network.encode_ros_handshake_header(header)),
    tried(network.decode_ros_handshake_header, b"\\x09\\0\\0\\0\\x01\\0\\0\\0a"),
]
"""
ROSLIB = """
import roslib.exceptions, roslib.network, roslib.packages, roslib.resources, roslib.rosenv
import roslib.scriptutil, roslib.srvs
result = [
    issubclass(roslib.packages.ROSPkgException, Exception), roslib.rosenv.ROS_MASTER_URI,
    roslib.network.ROS_IP, roslib.scriptutil.script_resolve_name("me", "~a"),
    roslib.srvs.EXT, roslib.srvs.IODELIM, roslib.srvs.COMMENTCHAR, roslib.srvs.SEP,
]
"""

ROSLIB_MSGS = """
from roslib import msgs
types = ["String", "String[]", "a/B", "a/B[3]", "Header", "std_msgs/Header", "roslib/Header[]", "",
         "uint8[]", "time", "int32[x]", "int32[3", "int32[1][2]", "int32[][]", "int32]", " int32",
         "1a", "a/b/c", "_x", "char", "a[", "a[-1]", "duration[]"]
result = [
    [[tried(one, type_) for type_ in types] for one in (
        msgs.base_msg_type, msgs.parse_type, msgs.is_valid_msg_type, msgs.is_valid_constant_type,
        msgs.is_valid_msg_field_name, msgs.is_builtin, msgs.is_header_type)],
    [msgs.resolve_type(type_, "p") for type_ in types], msgs.base_msg_type(None),
    msgs.PRIMITIVE_TYPES, msgs.BUILTIN_TYPES, msgs.RESERVED_TYPES, msgs.EXT, msgs.SEP,
    msgs.CONSTCHAR, msgs.COMMENTCHAR, msgs.HEADER, msgs.TIME, msgs.DURATION,
]
"""


@pytest.mark.parametrize(
    "snippet", [ROSGRAPH, ROSLIB, ROSLIB_MSGS], ids=["rosgraph", "roslib", "msgs"]
)
def test_they_are_as_in_ros_1(snippet: str) -> None:
    same(snippet, "roslib", "python3-roslib, python3-rosgraph")
