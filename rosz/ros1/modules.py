"""ROS 1's Python modules: which ones rosz has, and what to use instead of what is missing.

Some submodules of ROS 1 and rclpy hold names that are defined in another module here. They are not
files; the importer builds them from `SUBMODULES`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

from rosz.errors import near_miss

__all__ = (
    "ELSEWHERE",
    "EXTRAS",
    "LAST",
    "MODULES",
    "SUBMODULES",
    "add_submodules",
    "attribute",
    "explain_missing",
    "submodule",
)

MODULES = (
    "PyKDL",
    "actionlib",
    "bondpy",
    "camera_info_manager",
    "cv_bridge",
    "diagnostic_analysis",
    "diagnostic_updater",
    "dynamic_reconfigure",
    "genmsg",
    "genpy",
    "image_geometry",
    "interactive_markers",
    "laser_geometry",
    "message_filters",
    "ros_numpy",
    "rosbag",
    "rosgraph",
    "roslaunch",
    "roslib",
    "rosmsg",
    "rosnode",
    "rosparam",
    "rospkg",
    "rospy",
    "rosserial_python",
    "rosservice",
    "rostest",
    "rostopic",
    "rosunit",
    "roswtf",
    "smach",
    "smach_ros",
    "smclib",
    "tf",
    "tf2_geometry_msgs",
    "tf2_kdl",
    "tf2_py",
    "tf2_ros",
    "tf2_sensor_msgs",
    "tf_conversions",
)
"""ROS 1's Python modules, which lie beside this one."""

LAST = ("ros",)
"""Modules beside this one that a file or a package of the user's with their name hides."""

ELSEWHERE = {
    "ament_index_python": "ros2.ament_index_python",
    "rclpy": "ros2.rclpy",
    "sensor_msgs.point_cloud2": "ros1.point_cloud2",
    "tf_transformations": "ros1.tf.transformations",
}
"""Modules that do not lie beside this one, or have another name there; where below ``rosz``."""

_VISION = {"cv2": "vision", "numpy": "vision"}
EXTRAS: Mapping[str, Mapping[str, str]] = {
    "cv_bridge": _VISION,
    "image_geometry": _VISION,
    "laser_geometry": {"numpy": "numpy"},
    "ros_numpy": {"numpy": "numpy"},
}
"""Modules that need other distributions: what they import, and the extra of rosz that has it."""

_NAMES = (
    "is_legal_resource_base_name is_legal_resource_name package_resource_name resource_name"
    " resource_name_base resource_name_package"
)
_MESSAGE = {
    "errors": "DeserializationError=DecodeError SerializationError=EncodeError",
    "message": "Message",
    "message.convert": "fill_message_args strify_message",
    "ros1.genpy": "Duration Time check_type get_message_class get_printable_message_args"
    " get_service_class",
}

SUBMODULES: Mapping[str, Mapping[str, str]] = {
    "dynamic_reconfigure.encoding": {
        "reconfigure": "Config",
        "reconfigure.messages": "decode_config decode_description encode_config encode_description"
        " encode_groups extract_params get_tree group_dict in_groups initial_config",
    },
    "dynamic_reconfigure.exceptions": {
        "ros1.dynamic_reconfigure": "DynamicReconfigureCallbackException"
        " DynamicReconfigureException DynamicReconfigureParameterException"
    },
    "genmsg.msgs": {
        "ros1.roslib.msg_types": "BUILTIN_TYPES COMMENTCHAR CONSTCHAR DURATION PRIMITIVE_TYPES TIME"
        " bare_msg_type=base_msg_type is_builtin is_header_type is_valid_constant_type"
        " is_valid_msg_field_name is_valid_msg_type parse_type resolve_type",
        "ros1.genmsg": "EXT_MSG HEADER SEP InvalidMsgSpec",
    },
    "genmsg.names": {"ros1.genmsg": f"PRN_SEPARATOR normalize_package_context {_NAMES}"},
    "genpy.dynamic": {"ros1.genpy": "generate_dynamic"},
    "genpy.message": {
        **_MESSAGE,
        "ros1.genpy": f"MessageException is_simple {_MESSAGE['ros1.genpy']}",
    },
    "genpy.rostime": {"ros1.genpy": "Duration TVal Time"},
    "rclpy.action.client": {
        "ros2.rclpy.action": "ActionClient ClientGoalHandle GoalStatus",
    },
    "rclpy.action.server": {
        "ros2.rclpy.action": "ActionServer CancelResponse GoalResponse ServerGoalHandle",
    },
    "rclpy.callback_groups": {
        "ros2.rclpy.executors": "CallbackGroup MutuallyExclusiveCallbackGroup"
        " ReentrantCallbackGroup"
    },
    "rclpy.client": {"ros2.rclpy.entities": "Client"},
    "rclpy.clock": {"ros2.rclpy.time": "Clock ClockType ROSClock"},
    "rclpy.context": {"ros2.rclpy.context": "Context"},
    "rclpy.duration": {"ros2.rclpy.time": "Duration Infinite"},
    "rclpy.executors": {
        "ros2.rclpy.executors": "Entity Executor ExternalShutdownException MultiThreadedExecutor"
        " ShutdownException SingleThreadedExecutor TimeoutException"
    },
    "rclpy.parameter": {
        "ros2.rclpy.parameter": "PARAMETER_SEPARATOR_STRING Parameter get_parameter_value"
    },
    "rclpy.publisher": {"ros2.rclpy.entities": "Publisher"},
    "rclpy.service": {"ros2.rclpy.entities": "Service"},
    "rclpy.subscription": {"ros2.rclpy.entities": "Subscription"},
    "rclpy.task": {"ros2.rclpy.executors": "Future Task"},
    "rclpy.time": {"ros2.rclpy.time": "CONVERSION_CONSTANT ClockType Time"},
    "rclpy.timer": {"ros2.rclpy.entities": "Rate Timer"},
    "rclpy.utilities": {
        "ros2.rclpy.program": "get_default_context get_rmw_implementation_identifier ok"
        " remove_ros_args shutdown try_shutdown"
    },
    "rosgraph.rosenv": {
        "ros1.rosgraph.names": "DEFAULT_MASTER_PORT DEFAULT_MASTER_URI ROS_HOSTNAME ROS_IP ROS_IPV6"
        " ROS_MASTER_URI ROS_NAMESPACE get_master_uri"
    },
    "roslaunch.arg_dump": {"ros1.roslaunch.node_args": "dump_args get_args"},
    "roslaunch.launch": {
        "ros1.roslaunch.parent": "ROSLaunchRunner",
        "ros1.roslaunch.core": "RLException",
    },
    "roslaunch.nodeprocess": {"ros1.roslaunch.pmon": "LocalProcess=Process"},
    "roslaunch.param_dump": {"ros1.roslaunch.node_args": "dump_params"},
    "roslaunch.xmlloader": {
        "ros1.roslaunch.loader": "LoadException Loader XmlLoader XmlParseException"
    },
    "roslib.launcher": {"ros1.roslib.packages": "get_depends load_manifest"},
    "roslib.exceptions": {"ros1.roslib.packages": "ROSLibException"},
    "roslib.network": {
        "ros1.rosgraph.network": "ROSHandshakeException create_local_xmlrpc_uri"
        " decode_ros_handshake_header encode_ros_handshake_header get_address_override"
        " get_bind_address get_host_name get_local_address get_local_addresses is_local_address",
        "ros1.rosgraph.names": "ROS_HOSTNAME ROS_IP",
    },
    "roslib.resources": {
        "ros1.roslib.packages": "list_package_resources list_package_resources_by_dir"
    },
    "roslib.scriptutil": {
        "ros1.roslib.packages": "get_master get_param_server=get_master",
        "ros1.rosgraph.names": "script_resolve_name",
    },
    "roslib.message": {**_MESSAGE, "time": "TVal=StampValue"},
    "roslib.names": {
        "ros1.genmsg": f"PRN_SEPARATOR {_NAMES}",
        "ros1.roslib.packages": "TYPE_SEPARATOR",
        "ros1.rosgraph.names": "ANYTYPE GLOBALNS PRIV_NAME REMAP SEP anonymous_name"
        " canonicalize_name get_ros_namespace is_global is_legal_base_name is_legal_name is_private"
        " load_mappings make_caller_id make_global_ns namespace ns_join resolve_name",
    },
    "roslib.rospack": {
        "ros1.roslib.packages": "list_pkgs rospack_depends rospack_depends_1 rospack_depends_on"
        " rospack_depends_on_1",
        "ros1.rospkg": "ResourceNotFound RosPack",
    },
    "rospkg.common": {"ros1.rospkg": "MANIFEST_FILE PACKAGE_FILE ResourceNotFound"},
    "rospkg.distro": {"ros1.os_detect": "InvalidDistro current_distro_codename"},
    "rospkg.os_detect": {"ros1.os_detect": "OsDetect OsNotDetected"},
    "rospkg.environment": {
        "ros1.rospkg": "ROS_ETC_DIR ROS_HOME ROS_LOG_DIR ROS_PACKAGE_PATH ROS_ROOT"
        " ROS_TEST_RESULTS_DIR get_etc_ros_dir get_log_dir get_ros_home get_ros_package_path"
        " get_ros_paths get_ros_root get_test_results_dir on_ros_path"
    },
    "rospkg.manifest": {
        "ros1.rospkg": "MANIFEST_FILE PACKAGE_FILE Depend Export InvalidManifest Manifest"
        " ResourceNotFound RosDep read_manifest"
    },
    "rospkg.rospack": {
        "ros1.rospkg": "ManifestManager list_by_path RosPack RosStack get_package_name"
    },
    "rospy.exceptions": {
        "ros1.exceptions": "ROSException ROSInitException ROSInternalException"
        " ROSInterruptException ROSSerializationException ROSTimeMovedBackwardsException"
        " TransportException TransportInitError TransportTerminated"
    },
    "rospy.impl": {},
    "rospy.impl.rosout": {"ros1.rospy.core": "_rospy_to_logging_levels"},
    "rospy.impl.tcpros": {"ros1.rospy.topics": "DEFAULT_BUFF_SIZE"},
    "rospy.impl.tcpros_base": {"ros1.rospy.topics": "DEFAULT_BUFF_SIZE"},
    "rospy.impl.tcpros_service": {
        "ros1.rospy.service": "Service ServiceException ServiceImpl=Service ServiceProxy"
        " convert_return_to_response wait_for_service"
    },
    "tf.broadcaster": {"ros1.tf.frames": "TransformBroadcaster"},
    "tf.listener": {
        "ros1.tf.frames": "ConnectivityException Exception ExtrapolationException LookupException"
        " TransformListener Transformer TransformerROS"
    },
    "tf2_geometry_msgs.tf2_geometry_msgs": {
        "ros1.tf2_geometry_msgs": "do_transform_point do_transform_pose do_transform_vector3"
        " do_transform_wrench from_msg_msg to_msg_msg transform_to_kdl"
    },
    "tf2_kdl.tf2_kdl": {
        "ros1.tf2_kdl": "convert_vector do_transform_frame do_transform_twist do_transform_vector"
        " do_transform_wrench from_msg_vector to_msg_vector transform_to_kdl"
    },
    "tf2_sensor_msgs.tf2_sensor_msgs": {"ros1.tf2_sensor_msgs": "do_transform_cloud"},
    # ROS 1 connects the two types of /tf, which are equal but for their names.
    "tf.msg": {"msgs.tf2_msgs.msg": "tfMessage=TFMessage"},
}
"""Submodules of ROS 1 and rclpy: the modules below ``rosz`` that define their names, and the names.

``TVal=StampValue`` is the name ``TVal`` for ``StampValue``.
"""

_NO_MASTER = (
    "there is no master and no XML-RPC here; rospy.get_master() answers what a master would"
)
_NO_TCPROS = "messages travel over Zenoh, not TCPROS; use rospy.Publisher and rospy.Subscriber"
_NEEDS_MASTER = (
    "get_registration_listeners get_service_manager set_node_uri set_service_manager xmlrpcapi"
    " xmlrpcclient"
)
_NEEDS_TCPROS = (
    "get_tcpros_handler get_tcpros_server_address get_topic_manager init_tcpros QueuedConnection"
    " set_topic_manager TCPROSHandler TCPROSTransport"
)
_REASONS = {
    "start_node": "use rospy.init_node()",
    **dict.fromkeys(_NEEDS_MASTER.split(), _NO_MASTER),
    **dict.fromkeys(_NEEDS_TCPROS.split(), _NO_TCPROS),
}


def submodule(name: str) -> ModuleType:
    """Build a module of `SUBMODULES`, such as ``rospy.impl.tcpros``."""
    module = ModuleType(name, f"``{name}``: names that programs import from here.")
    for home, names in SUBMODULES[name].items():
        defined = import_module(f"rosz.{home}")
        for each in names.split():
            public, _, own = each.partition("=")
            setattr(module, public, getattr(defined, own or public))
    vars(module)["__all__"] = tuple(sorted(one for one in vars(module) if not one.startswith("_")))
    return module


def add_submodules(name: str) -> None:
    """Import the built submodules of a module, as ROS 1's own modules do when they load."""
    for one in SUBMODULES:
        if one.rpartition(".")[0] == name:
            import_module(one)


def explain_missing(name: str, module: ModuleType) -> None:
    """Make a module and its loaded submodules say what to use instead of a missing name."""
    vars(module).setdefault("__getattr__", attribute(name, module, {}))
    own = f"{module.__name__}."
    for inner in list(vars(module).values()):
        if isinstance(inner, ModuleType) and inner.__name__.startswith(own):
            shown = f"{name}.{inner.__name__.removeprefix(own)}"
            vars(inner).setdefault("__getattr__", attribute(shown, inner, {}))


def attribute(name: str, module: ModuleType, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a module; its errors say what to use instead.

    Args:
        name: Name of the module in error texts.
        module: The module.
        homes: Names that are loaded when they are first used, and the modules that define them.
    """

    def get(wanted: str) -> Any:
        if wanted in homes:
            home = import_module(homes[wanted])
            value = home if home.__name__.endswith(f".{wanted}") else getattr(home, wanted)
            setattr(module, wanted, value)
            return value
        text = f"module '{name}' of rosz has no attribute '{wanted}'"
        reason = _REASONS.get(wanted)
        if reason is None and not wanted.startswith("_"):
            reason = near_miss(wanted, [n for n in vars(module) if not n.startswith("_")])
            reason = reason.removeprefix("; ")
        raise AttributeError(f"{text}; {reason}" if reason else text, name=wanted, obj=module)

    return get
