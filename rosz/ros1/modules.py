"""ROS 1's Python modules: the ones that rosz has, and replacements for names that it lacks.

A module is here if public packages import it, and so is each of its names. `rosz.replacements` has
the answers for modules that are not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from types import FunctionType, MethodType, ModuleType
from typing import Any, NamedTuple

from rosz.errors import near_miss
from rosz.replacements import instead_of


class Module(NamedTuple):
    """A module as programs import it.

    Attributes:
        home: Module below ``rosz`` that it is; empty for one that the importer builds.
        names: Of a built one, the modules below ``rosz`` that define its names, and the names.
            ``TVal=StampValue`` is the name ``TVal`` for ``StampValue``.
        extras: Modules from PyPI that it imports, and the extras of rosz that bring them.
    """

    home: str = ""
    names: Mapping[str, str] = {}
    extras: Mapping[str, str] = {}


_CLIENT = (
    "actionlib dynamic_reconfigure genmsg genpy message_filters rospy tf"
    " tf2_geometry_msgs tf2_py tf2_ros tf2_sensor_msgs"
)
_TOOLS = (
    "rosbag rosgraph roslaunch roslib rosmsg rosnode rosparam rospkg rosservice"
    " rostest rostopic rosunit"
)
_LIBRARIES = (
    "PyKDL bondpy camera_info_manager cv_bridge diagnostic_updater"
    " image_geometry interactive_markers laser_geometry ros_numpy"
    " rosserial_python smach smach_ros tf2_kdl tf_conversions"
)
_NUMPY = {"numpy": "numpy"}
_VISION = {"cv2": "vision", "numpy": "vision"}
_EXTRAS = {
    "cv_bridge": _VISION,
    "image_geometry": _VISION,
    "laser_geometry": _NUMPY,
    "ros_numpy": _NUMPY,
}
_NAMES = (
    "is_legal_resource_base_name is_legal_resource_name package_resource_name resource_name"
    " resource_name_base resource_name_package"
)
_MESSAGE = {
    "errors": "DeserializationError=DecodeError SerializationError=EncodeError",
    "message": "Message",
    "message.convert": "fill_message_args strify_message",
    "ros1.client.genpy": "Duration Time check_type get_message_class get_printable_message_args"
    " get_service_class",
}

_BUILT: Mapping[str, Mapping[str, str]] = {
    "actionlib.exceptions": {"errors": "ActionException=UsageError"},
    "actionlib.goal_id_generator": {"ros1.client.actionlib.action_server": "GoalIDGenerator"},
    "actionlib.handle_tracker_deleter": {
        "ros1.client.actionlib.action_server": "HandleTrackerDeleter"
    },
    "actionlib.server_goal_handle": {"ros1.client.actionlib.action_server": "ServerGoalHandle"},
    "actionlib.simple_action_client": {
        "ros1.client.actionlib.action_client": "SimpleActionClient SimpleGoalState",
    },
    "actionlib.simple_action_server": {"ros1.client.actionlib.action_server": "SimpleActionServer"},
    "actionlib.status_tracker": {"ros1.client.actionlib.action_server": "StatusTracker"},
    "ament_index_python.packages": {
        "ros2.ament_index_python": "PackageNotFoundError get_package_prefix"
        " get_package_share_directory get_package_share_path get_packages_with_prefixes",
    },
    "bondpy.bondpy": {"ros1.libraries.bondpy": "Bond as_float_duration as_ros_duration"},
    "camera_info_manager.camera_info_manager": {
        "ros1.libraries.camera_info_manager": "CameraInfo CameraInfoError CameraInfoManager"
        " CameraInfoMissingError SetCameraInfo SetCameraInfoResponse URL_empty URL_file URL_invalid"
        " URL_package default_camera_info_url genCameraName getPackageFileName loadCalibrationFile"
        " parseURL resolveURL saveCalibration saveCalibrationFile"
    },
    "cv_bridge.boost": {},
    "cv_bridge.boost.cv_bridge_boost": {
        "ros1.libraries.cv_bridge": "CV_MAT_CNWrap CV_MAT_DEPTHWrap cvtColor2 cvtColorForDisplay"
        " getCvType",
    },
    "cv_bridge.core": {"ros1.libraries.cv_bridge": "CvBridge CvBridgeError"},
    "diagnostic_updater._diagnostic_status_wrapper": {
        "ros1.libraries.diagnostic_updater": "ERROR OK WARN DiagnosticStatusWrapper",
    },
    "diagnostic_updater._diagnostic_updater": {
        "ros1.libraries.diagnostic_updater": "CompositeDiagnosticTask DiagnosticTask"
        " DiagnosticTaskVector FunctionDiagnosticTask Updater",
    },
    "diagnostic_updater._publisher": {
        "ros1.libraries.diagnostic_updater": "DiagnosedPublisher HeaderlessTopicDiagnostic"
        " TopicDiagnostic",
    },
    "diagnostic_updater._update_functions": {
        "ros1.libraries.diagnostic_updater": "FrequencyStatus FrequencyStatusParam Heartbeat"
        " TimeStampStatus TimeStampStatusParam",
    },
    "dynamic_reconfigure.encoding": {
        "reconfigure": "Config",
        "reconfigure.messages": "decode_config decode_description encode_config encode_description"
        " encode_groups extract_params get_tree group_dict in_groups initial_config",
    },
    "dynamic_reconfigure.exceptions": {
        "ros1.client.dynamic_reconfigure": "DynamicReconfigureCallbackException"
        " DynamicReconfigureException DynamicReconfigureParameterException",
    },
    "dynamic_reconfigure.parameter_generator": {
        "ros1.client.dynamic_reconfigure.parameter_generator_catkin": "ParameterGenerator Template"
        " bool_t double_t inspect int_t os re str_t sys",
        "ros1.tools.roslib": "",  # loads it
        "ros1.tools": "roslib",
    },
    "genmsg.msgs": {
        "ros1.tools.roslib.msgs": "BUILTIN_TYPES COMMENTCHAR CONSTCHAR DURATION PRIMITIVE_TYPES"
        " TIME bare_msg_type=base_msg_type is_builtin is_header_type is_valid_constant_type"
        " is_valid_msg_field_name is_valid_msg_type parse_type resolve_type",
        "ros1.client.genmsg": "EXT_MSG HEADER SEP InvalidMsgSpec",
    },
    "genmsg.names": {"ros1.client.genmsg": f"PRN_SEPARATOR normalize_package_context {_NAMES}"},
    "genpy.dynamic": {"ros1.client.genpy": "generate_dynamic"},
    "genpy.message": {
        **_MESSAGE,
        "ros1.client.genpy": f"MessageException is_simple {_MESSAGE['ros1.client.genpy']}",
    },
    "genpy.rostime": {"ros1.client.genpy": "Duration TVal Time"},
    "image_geometry.cameramodels": {
        "ros1.libraries.image_geometry": "PinholeCameraModel StereoCameraModel mkmat"
    },
    "interactive_markers.interactive_marker_server": {
        "ros1.libraries.interactive_markers": "Header InteractiveMarker InteractiveMarkerFeedback"
        " InteractiveMarkerInit InteractiveMarkerPose InteractiveMarkerServer"
        " InteractiveMarkerUpdate Lock MarkerContext UpdateContext rospy",
    },
    "interactive_markers.menu_handler": {
        "ros1.libraries.interactive_markers": "EntryContext InteractiveMarkerFeedback MenuEntry"
        " MenuHandler rospy",
    },
    "laser_geometry.laser_geometry": {"ros1.libraries.laser_geometry": "LaserProjection"},
    "rclpy.action.client": {
        "ros2.rclpy.action": "ActionClient ClientGoalHandle GoalStatus",
    },
    "rclpy.action.server": {
        "ros2.rclpy.action": "ActionServer CancelResponse GoalResponse ServerGoalHandle",
    },
    "rclpy.callback_groups": {
        "ros2.rclpy.executors": "CallbackGroup MutuallyExclusiveCallbackGroup"
        " ReentrantCallbackGroup",
    },
    "rclpy.client": {"ros2.rclpy.entities": "Client"},
    "rclpy.clock": {"ros2.rclpy.time": "Clock ClockType ROSClock"},
    "rclpy.context": {"ros2.rclpy.context": "Context"},
    "rclpy.duration": {"ros2.rclpy.time": "Duration Infinite"},
    "rclpy.event_handler": {
        "ros2.rclpy.events": "EventHandler PublisherEventCallbacks QoSEventHandler=EventHandler"
        " QoSMessageLostInfo=MessageLostInfo QoSPublisherMatchedInfo=MatchedInfo"
        " QoSSubscriptionMatchedInfo=MatchedInfo SubscriptionEventCallbacks"
        " IncompatibleTypeInfo UnsupportedEventTypeError",
    },
    "rclpy.executors": {
        "ros2.rclpy.executors": "Entity Executor ExternalShutdownException MultiThreadedExecutor"
        " ShutdownException SingleThreadedExecutor TimeoutException await_or_execute=completed",
    },
    "rclpy.guard_condition": {"ros2.rclpy.events": "GuardCondition"},
    "rclpy.impl": {"ros2.rclpy": "logging"},
    "rclpy.impl.logging_severity": {"ros2.rclpy.logging": "LoggingSeverity"},
    "rclpy.impl.rcutils_logger": {"ros2.rclpy.logging": "RcutilsLogger"},
    "rclpy.parameter": {
        "ros2.rclpy.parameter": "PARAMETER_SEPARATOR_STRING Parameter get_parameter_value"
        " parameter_dict_from_yaml_file parameter_value_to_python",
    },
    "rclpy.publisher": {"ros2.rclpy.entities": "Publisher"},
    "rclpy.qos_event": {
        "ros2.rclpy.events": "PublisherEventCallbacks SubscriptionEventCallbacks"
        " UnsupportedEventTypeError",
    },
    "rclpy.qos_overriding_options": {
        "ros2.rclpy.qos": "InvalidQosOverridesError QoSOverridingOptions"
        " QosCallbackResult=SetParametersResult",
    },
    "rclpy.serialization": {"ros2.rclpy.program": "deserialize_message serialize_message"},
    "rclpy.service": {"ros2.rclpy.entities": "Service"},
    "rclpy.signals": {"ros2.rclpy.program": "SignalHandlerOptions"},
    "rclpy.subscription": {"ros2.rclpy.entities": "Subscription"},
    "rclpy.task": {"ros2.rclpy.executors": "Future Task"},
    "rclpy.time": {"ros2.rclpy.time": "CONVERSION_CONSTANT ClockType Duration Time"},
    "rclpy.timer": {"ros2.rclpy.entities": "Timer", "ros2.rclpy.time": "Rate"},
    "rclpy.utilities": {
        "ros2.rclpy.program": "get_default_context get_rmw_implementation_identifier ok"
        " remove_ros_args shutdown try_shutdown",
    },
    "rclpy.wait_for_message": {"ros2.rclpy.program": "wait_for_message"},
    "ros_numpy.geometry": {
        "ros1.libraries.ros_numpy": "Point Pose Quaternion Transform Vector3 converts_from_numpy"
        " converts_to_numpy np numpy_to_point numpy_to_pose numpy_to_quat numpy_to_transform"
        " numpy_to_vector3 point_to_numpy pose_to_numpy quat_to_numpy transform_to_numpy"
        " transformations vector3_to_numpy",
    },
    "ros_numpy.image": {
        "ros1.libraries.ros_numpy": "Image converts_from_numpy converts_to_numpy image_to_numpy"
        " name_to_dtypes np numpy_to_image sys",
    },
    "ros_numpy.occupancy_grid": {
        "ros1.libraries.ros_numpy": "MapMetaData OccupancyGrid converts_from_numpy"
        " converts_to_numpy np numpy_to_occupancy_grid occupancygrid_to_numpy sys",
    },
    "ros_numpy.point_cloud2": {
        "ros1.libraries.ros_numpy": "DUMMY_FIELD_PREFIX PointCloud2 PointField"
        " array_to_pointcloud2 converts_from_numpy converts_to_numpy dtype_to_fields"
        " fields_to_dtype get_xyz_points merge_rgb_fields np nptype_to_pftype pftype_sizes"
        " pftype_to_nptype pointcloud2_to_array pointcloud2_to_xyz_array split_rgb_field"
        " type_mappings",
    },
    "ros_numpy.registry": {
        "ros1.libraries.ros_numpy": "converts_from_numpy converts_to_numpy msgify numpify",
    },
    "rosbag.bag": {
        "ros1.tools.rosbag": "Bag BagMessage BagMessageWithConnectionHeader Compression"
        " CompressionTuple ROSBagEncryptException ROSBagEncryptNotSupportedException"
        " ROSBagException ROSBagFormatException ROSBagUnindexedException TopicTuple"
        " TypesAndTopicsTuple",
    },
    "rosbag.rosbag_main": {"ros1.tools.rosbag": "rosbagmain"},
    "rosgraph.impl": {},
    "rosgraph.rosenv": {
        "ros1.tools.rosgraph.names": "DEFAULT_MASTER_PORT DEFAULT_MASTER_URI ROS_HOSTNAME ROS_IP"
        " ROS_IPV6 ROS_MASTER_URI ROS_NAMESPACE get_master_uri",
    },
    "roslaunch.arg_dump": {"ros1.tools.roslaunch.node_args": "dump_args get_args"},
    "roslaunch.launch": {
        "ros1.tools.roslaunch.parent": "ROSLaunchRunner",
        "ros1.tools.roslaunch.core": "RLException",
    },
    "roslaunch.nodeprocess": {"ros1.tools.roslaunch.pmon": "LocalProcess=Process"},
    "roslaunch.param_dump": {"ros1.tools.roslaunch.node_args": "dump_params"},
    "roslaunch.rlutil": {
        "ros1.tools.roslaunch.node_args": "check_log_disk_usage check_roslaunch"
        " resolve_launch_arguments",
        "ros1.tools.roslaunch.parent": "get_or_generate_uuid",
    },
    "roslaunch.scriptapi": {"ros1.tools.roslaunch.parent": "ROSLaunch"},
    "roslaunch.substitution_args": {
        "ros1.tools.roslaunch.loader": "ArgException SubstitutionException resolve_args",
    },
    "roslaunch.xmlloader": {
        "ros1.tools.roslaunch.loader": "LoadException Loader XmlLoader XmlParseException",
    },
    "roslib.exceptions": {"ros1.tools.roslib.packages": "ROSLibException"},
    "roslib.launcher": {"ros1.tools.roslib.packages": "get_depends load_manifest"},
    "roslib.message": {**_MESSAGE, "time": "TVal=StampValue"},
    "roslib.names": {
        "ros1.client.genmsg": f"PRN_SEPARATOR {_NAMES}",
        "ros1.tools.roslib.packages": "TYPE_SEPARATOR",
        "ros1.tools.rosgraph.names": "ANYTYPE GLOBALNS PRIV_NAME REMAP SEP anonymous_name"
        " canonicalize_name get_ros_namespace is_global is_legal_base_name is_legal_name is_private"
        " load_mappings make_caller_id make_global_ns namespace ns_join resolve_name",
    },
    "roslib.network": {
        "ros1.tools.rosgraph.network": "ROSHandshakeException create_local_xmlrpc_uri"
        " decode_ros_handshake_header encode_ros_handshake_header get_address_override"
        " get_bind_address get_host_name get_local_address get_local_addresses is_local_address",
        "ros1.tools.rosgraph.names": "ROS_HOSTNAME ROS_IP",
    },
    "roslib.resources": {
        "ros1.tools.roslib.packages": "list_package_resources list_package_resources_by_dir",
    },
    "roslib.rosenv": {
        "ros1.tools.rosgraph.names": "ROS_HOSTNAME ROS_IP ROS_MASTER_URI ROS_NAMESPACE"
        " get_master_uri",
        "ros1.tools.rospkg": "ROS_HOME ROS_LOG_DIR ROS_PACKAGE_PATH ROS_ROOT get_log_dir"
        " get_ros_home get_test_results_dir",
    },
    "roslib.rospack": {
        "ros1.tools.roslib.packages": "list_pkgs rospack_depends rospack_depends_1"
        " rospack_depends_on rospack_depends_on_1",
        "ros1.tools.rospkg": "ResourceNotFound RosPack",
    },
    "roslib.scriptutil": {
        "ros1.tools.roslib.packages": "get_master get_param_server=get_master",
        "ros1.tools.rosgraph.names": "script_resolve_name",
    },
    "roslib.srvs": {
        "ros1.client.genmsg": "EXT=EXT_SRV SEP",
        "ros1.tools.roslib.msgs": "COMMENTCHAR IODELIM list_srv_types srv_file",
    },
    "rospkg.common": {"ros1.tools.rospkg": "MANIFEST_FILE PACKAGE_FILE ResourceNotFound"},
    "rospkg.environment": {
        "ros1.tools.rospkg": "ROS_ETC_DIR ROS_HOME ROS_LOG_DIR ROS_PACKAGE_PATH ROS_ROOT"
        " ROS_TEST_RESULTS_DIR get_etc_ros_dir get_log_dir get_ros_home get_ros_package_path"
        " get_ros_paths get_ros_root get_test_results_dir on_ros_path",
    },
    "rospkg.manifest": {
        "ros1.tools.rospkg": "MANIFEST_FILE PACKAGE_FILE Depend Export InvalidManifest Manifest"
        " ResourceNotFound RosDep read_manifest",
    },
    "rospkg.rospack": {
        "ros1.tools.rospkg": "ManifestManager list_by_path RosPack RosStack get_package_name",
    },
    "rospy.impl": {},
    "rospy.impl.rosout": {"ros1.client.rospy.core": "_rospy_to_logging_levels"},
    "rospy.impl.tcpros": {"ros1.client.rospy.topics": "DEFAULT_BUFF_SIZE"},
    "rospy.impl.tcpros_base": {"ros1.client.rospy.topics": "DEFAULT_BUFF_SIZE"},
    "rospy.impl.tcpros_service": {
        "ros1.client.rospy.service": "Service ServiceException ServiceImpl=Service ServiceProxy"
        " convert_return_to_response wait_for_service",
    },
    "smach.exceptions": {
        "ros1.libraries.smach.util": "InvalidConstructionError InvalidStateError"
        " InvalidTransitionError InvalidUserCodeError SmachError",
    },
    "smach.log": {"ros1.libraries.smach.util": "logdebug logerr loginfo logwarn set_loggers"},
    "smach.sequence": {"ros1.libraries.smach": "Sequence"},
    "smach.state_machine": {"ros1.libraries.smach": "StateMachine"},
    "smach_ros.condition_state": {"ros1.libraries.smach_ros": "ConditionState"},
    "smach_ros.monitor_state": {"ros1.libraries.smach_ros": "MonitorState"},
    "smach_ros.ros_state": {"ros1.libraries.smach_ros": "RosState"},
    "smach_ros.service_state": {"ros1.libraries.smach_ros.callback_states": "ServiceState"},
    "smach_ros.simple_action_state": {
        "ros1.libraries.smach_ros.callback_states": "SimpleActionState",
    },
    "smach_ros.util": {"ros1.libraries.smach_ros": "set_preempt_handler"},
    "tf.broadcaster": {"ros1.client.tf": "TransformBroadcaster"},
    "tf.listener": {
        "ros1.client.tf": "ConnectivityException Exception ExtrapolationException"
        " LookupException TransformListener Transformer TransformerROS",
    },
    # ROS 1 connects the two types of /tf, which are equal but for their names.
    "tf.msg": {"msgs.tf2_msgs.msg": "tfMessage=TFMessage"},
    "tf2_geometry_msgs.tf2_geometry_msgs": {
        "ros1.client.tf2_geometry_msgs": "do_transform_point do_transform_pose"
        " do_transform_vector3 do_transform_wrench from_msg_msg to_msg_msg transform_to_kdl",
    },
    "tf2_kdl.tf2_kdl": {
        "ros1.libraries.tf2_kdl": "convert_vector do_transform_frame do_transform_twist"
        " do_transform_vector do_transform_wrench from_msg_vector to_msg_vector transform_to_kdl",
    },
    "tf2_ros.buffer_client": {"ros1.client.tf2_ros": "BufferClient"},
    "tf2_ros.buffer_server": {"ros1.client.tf2_ros": "BufferServer"},
    "tf2_ros.static_transform_broadcaster": {
        "ros1.client.tf2_ros.buffer": "StaticTransformBroadcaster"
    },
    "tf2_ros.transform_broadcaster": {"ros1.client.tf2_ros.buffer": "TransformBroadcaster node_of"},
    "tf2_ros.transform_listener": {"ros1.client.tf2_ros.buffer": "TransformListener"},
    "tf2_sensor_msgs.tf2_sensor_msgs": {"ros1.client.tf2_sensor_msgs": "do_transform_cloud"},
    "tf_conversions.posemath": {
        "ros1.libraries.tf_conversions": "Equal Frame Point Pose Quaternion Rotation SetToZero"
        " Twist Vector Wrench addDelta diff dot fromCameraParams fromMatrix fromMsg fromTf numpy"
        " toMatrix toMsg toTf transformations",
    },
}
"""Submodules that are no files: they hold names of other modules."""

MODULES: Mapping[str, Module] = {
    **{
        name: Module(f"ros1.{part}.{name}", extras=_EXTRAS.get(name, {}))
        for part, names in (("client", _CLIENT), ("tools", _TOOLS), ("libraries", _LIBRARIES))
        for name in names.split()
    },
    "ament_index_python": Module("ros2.ament_index_python"),
    "rclpy": Module("ros2.rclpy"),
    "rosgraph.impl.graph": Module("ros1.tools.rosgraph.graph"),
    "rospy.exceptions": Module("ros1.exceptions"),
    "sensor_msgs.point_cloud2": Module("ros1.client.point_cloud2"),
    "sensor_msgs_py": Module("ros2.sensor_msgs_py", extras=_NUMPY),
    "tf_transformations": Module("ros1.client.tf.transformations"),
    **{name: Module(names=names) for name, names in _BUILT.items()},
}
"""Modules of ROS 1 and rclpy, by the names that programs import."""

_NO_MASTER = (
    "there is no master and no XML-RPC here; rospy.get_master() answers what a master would"
)
_NO_TCPROS = "messages travel over Zenoh, not TCPROS; use rospy.Publisher and rospy.Subscriber"
_NEEDS_MASTER = (
    "XmlRpcHandler XmlRpcNode get_registration_listeners get_service_manager set_node_uri"
    " set_service_manager xmlrpcapi xmlrpcclient"
)
_NEEDS_TCPROS = (
    "get_tcpros_handler get_tcpros_server_address get_topic_manager init_tcpros QueuedConnection"
    " set_topic_manager TCPROSHandler TCPROSTransport"
)
_GENERATORS = (
    "REGISTERED_TYPES MsgSpec SrvSpec get_registered load_by_type load_from_file load_from_string"
    " load_package"
)
_NO_ZOOM = instead_of("camera_info_manager.zoom_camera_info_manager")
_REASONS = {
    "XMLTestRunner": "rosunit.unitrun() writes results as JUnit XML",
    "start_node": "use rospy.init_node()",
    **dict.fromkeys(
        _GENERATORS.split(),
        "definitions are compiled as they are imported; a message class has _slot_types, _md5sum"
        " and _full_text",
    ),
    **dict.fromkeys(
        (
            "ApproximateZoomCameraInfoManager",
            "InterpolatingZoomCameraInfoManager",
            "ZoomCameraInfoManager",
        ),
        _NO_ZOOM,
    ),
    **dict.fromkeys(_NEEDS_MASTER.split(), _NO_MASTER),
    **dict.fromkeys(_NEEDS_TCPROS.split(), _NO_TCPROS),
}

_VALUES = (str, bytes, int, float, tuple, list, dict, set, frozenset, MethodType)
"""Types of constants, and of the functions of command lines, which are methods of a `Tool`."""


def submodule(name: str) -> ModuleType:
    """Build a module of `MODULES` that is no file, such as ``rospy.impl.tcpros``."""
    module = ModuleType(name, f"``{name}``: names that programs import from here.")
    for home, names in MODULES[name].names.items():
        defined = import_module(f"rosz.{home}")
        for each in names.split():
            public, _, own = each.partition("=")
            setattr(module, public, getattr(defined, own or public))
    vars(module)["__all__"] = tuple(sorted(key for key in vars(module) if not key.startswith("_")))
    return module


def add_submodules(name: str) -> None:
    """Import the built submodules of a module, as ROS 1's own modules do when they load."""
    for inner, module in MODULES.items():
        if inner.rpartition(".")[0] == name and not module.home:
            import_module(inner)


def list_exports(module: ModuleType) -> None:
    """Give a module without ``__all__`` one: the public names that the module itself defines.

    ROS 1's modules have none; ``import *`` of them must not bind what rosz imports there.
    """
    own = [key for key, value in vars(module).items() if key[0] != "_" and _defines(module, value)]
    vars(module).setdefault("__all__", tuple(sorted(own)))


def _defines(module: ModuleType, value: object) -> bool:
    if isinstance(value, type | FunctionType):
        return value.__module__ == module.__name__
    return isinstance(value, _VALUES) or type(value).__module__ == module.__name__


def explain_missing(name: str, module: ModuleType) -> None:
    """Make a module and its loaded submodules name replacements of missing names."""
    vars(module).setdefault("__getattr__", attribute(name, module, {}))
    own = f"{module.__name__}."
    for inner in list(vars(module).values()):
        if isinstance(inner, ModuleType) and inner.__name__.startswith(own):
            shown = f"{name}.{inner.__name__.removeprefix(own)}"
            vars(inner).setdefault("__getattr__", attribute(shown, inner, {}))


def attribute(name: str, module: ModuleType, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a module; its errors name replacements.

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
