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

_BUILD = "the generators that catkin calls in builds; rosz compiles definitions with rosz.idl"
_ROSBUILD = "manifests and stacks of rosbuild; rospkg reads them"
_PRIVATE = "sets or calls private names of rospy's modules"
_SLAVE = "the slave API of nodes, which belongs to bridges to ROS 1"

_OFFLINE = "expects an error without a master; topics and services need none"
_URIS = "expects URIs of XML-RPC or TCPROS"
_ROSOUT = "expects the node rosout, which ROS 1's roscore starts"

INTERNAL = {
    ("*", "*test_offline"): _OFFLINE,
    ("rosservice.test", "*test_rosservice"): _URIS,
    ("rosservice_unit.test", "*test_cmd_uri"): _URIS,
    ("rosservice_unit.test", "*test_get_service_headers"): _TCPROS,
    ("rosnode.test", "*test_rosnode"): _URIS,
    ("test_rosnode.py", "*test_rosnode_ping*"): _ROSOUT,
    ("masterapi.test", "*egister*"): _XMLRPC,
    ("masterapi.test", "*test_lookup*"): _URIS,
    ("distro_version.test", "*"): "compares with rosversion of the system",
    ("test_message_filters_cache.py", "*test_headerless"): _PRIVATE,
    ("test_rostopic_unit.py", "*str_plot*"): _PRIVATE,
    (
        "test_rosmsg_command_line.py",
        "*test_cmd_help",
    ): "imports the sources of ROS 1's rosmsg",
    ("test_nodeprocess.py", "*"): _LAUNCH,
    ("test_roslaunch_child.py", "*"): _LAUNCH,
    ("test_roslaunch_launch.py", "*"): _LAUNCH,
    ("test_roslaunch_parent.py", "*"): "replaces the insides of roslaunch's parent by mocks",
    ("test_roslaunch_pmon.py", "*"): _LAUNCH,
    ("test_roslaunch_remote.py", "*"): _LAUNCH,
    ("test_roslaunch_server.py", "*"): _LAUNCH,
    ("test_roslaunch_depends.py", "*"): "what catkin's roslaunch_add_file_check calls in builds",
    ("test_substitution_args.py", "*test__arg"): "the function behind one of the substitutions",
    ("test_rospy_tcpros.py", "*"): _TCPROS,
    ("test_rospy_tcpros_base.py", "*"): _TCPROS,
    ("test_rospy_tcpros_pubsub.py", "*"): _TCPROS,
    ("test_rospy_tcpros_service.py", "*TCP*"): _TCPROS,
    ("test_rospy_tcpros_service.py", "*test_service_connection_handler"): _TCPROS,
    ("test_rospy_transport.py", "*"): _TCPROS,
    ("test_rospy_registration.py", "*"): _XMLRPC,
    ("test_rospy_paramserver.py", "*"): "rospy's cache of parameters; every process has a replica",
    ("test_rospy_validators.py", "*"): "validators of XML-RPC arguments",
    ("test_node_api.py", "*"): _XMLRPC,
    ("test_xmlrpc.py", "*"): _XMLRPC,
    ("test_rosgraph_masterapi_offline.py", "*"): "puts a mock in the place of the XML-RPC proxy",
    ("test_network.py", "*xmlrpc_uri"): _XMLRPC,
    ("test_network.py", "*handshake_header*"): _TCPROS,
    ("test_network.py", "*bind_address"): _TCPROS,
    ("test_genpy_base.py", "*"): _BUILD,
    ("test_genpy_gen*.py", "*"): _BUILD,
    ("test_genmsg_base.py", "*log"): _BUILD,
    ("test_roslib_gentools.py", "*"): _BUILD,
    ("test_roslib_manifest*.py", "*"): _ROSBUILD,
    ("test_roslib_stack*.py", "*"): _ROSBUILD,
    ("test_xmlrunner.py", "*"): "no public package imports rosunit's runner",
    ("test_genmsg_command_line.py", "*"): _BUILD,
    ("test_genmsg_gentools.py", "*"): _BUILD,
    ("test_genmsg_msg_loader.py", "*"): _BUILD,
    ("test_genmsg_msgs.py", "*test_Constant"): _BUILD,
    ("test_genmsg_msgs.py", "*test_Field"): _BUILD,
    ("test_genmsg_msgs.py", "*test_MsgSpec"): _BUILD,
    ("test_genmsg_srvs.py", "*"): _BUILD,
    ("test_rospy_topics.py", "*"): "TCPROS connections that the test makes up, and rospy.impl",
    ("test_rospy_names.py", "*test_mappings"): _PRIVATE,
    ("test_rospy_names.py", "*test_caller_id"): _PRIVATE,
    ("test_rospy_names.py", "*test_valid_name"): "validators of XML-RPC arguments",
    ("test_rospy_names.py", "*test_global_name"): "validators of XML-RPC arguments",
    ("test_rospy_core.py", "*test_loggers"): _PRIVATE,
    ("test_rospy_core.py", "*test_add_preshutdown_hook"): _PRIVATE,
    ("test_rospy_core.py", "*test_node_uri"): _PRIVATE,
    ("test_rospy_core.py", "*test_initialized"): _PRIVATE,
    ("test_rospy_core.py", "*test_shutdown*"): _PRIVATE,
    ("test_rospy_core.py", "*test_valid_name"): "validators of XML-RPC arguments",
    ("test_rospy_core.py", "*test_is_topic"): "validators of XML-RPC arguments",
    ("test_rospy_core.py", "*test_xmlrpcapi"): _XMLRPC,
    ("test_rospy_service.py", "*test_ServiceManager"): _PRIVATE,
    ("test_rospy_rostime.py", "*test_import_simtime"): _PRIVATE,
    ("test_publisher_consistency_listener.py", "*fails_without"): "expects lost first messages",
    ("rospy*.test", "*test_log"): "takes rospy's handlers out of a logger by their number",
    ("client-param-server.test", "*test_search_param"): _PRIVATE,
    ("test_bag.py", "*test_reindex_*"): "private names of rosbag.bag, and the places of records",
    ("test_bag.py", "*test_future_version_works"): "private names of rosbag.bag",
    ("test_bag.py", "*test_get_compression_info"): "the size of the comments in definitions",
    ("test_bag.py", "*test_get_messages_filter_works"): "the comments in definitions",
    ("node.test", "*"): _SLAVE,
    ("deregister.test", "*test_unpublish"): _SLAVE,
    ("deregister.test", "*test_unsubscribe"): _SLAVE,
}
"""Reasons, by patterns of file names and of test names."""


def reason(file: Path, test: str) -> str:
    """Return why a test is left out, or an empty text."""
    for (name, pattern), text in INTERNAL.items():
        if fnmatch(file.name, name) and fnmatch(test, pattern):
            return text
    return ""
