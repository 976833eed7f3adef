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
        names: Of a built one, the modules that have its names, and the names. Modules of rosz for a
            package of ROS begin with its name. ``TVal=StampValue`` is the name ``TVal`` for
            ``StampValue``; ``*`` is all.
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
    " resource_retriever rosserial_python smach smach_ros tf2_kdl tf_conversions"
)
HIDEABLE = frozenset(_LIBRARIES.split()) - {"PyKDL", "cv_bridge", "tf2_kdl"}
"""Libraries in Python alone, which a package of the user may hide."""

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
_MESSAGE = (
    "rosz.errors: DeserializationError=DecodeError SerializationError=EncodeError; rosz.message:"
    " Message; rosz.message.convert: fill_message_args strify_message; genpy: Duration Time"
    " check_type get_message_class get_printable_message_args get_service_class"
)

_BUILT: Mapping[str, str] = {
    "actionlib.exceptions": "rosz.errors: ActionException=UsageError",
    "actionlib.goal_id_generator": "actionlib.action_server: GoalIDGenerator",
    "actionlib.handle_tracker_deleter": "actionlib.action_server: HandleTrackerDeleter",
    "actionlib.server_goal_handle": "actionlib.action_server: ServerGoalHandle",
    "actionlib.simple_action_client": "actionlib.action_client: SimpleActionClient SimpleGoalState",
    "actionlib.simple_action_server": "actionlib.action_server: SimpleActionServer",
    "actionlib.status_tracker": "actionlib.action_server: StatusTracker",
    "ament_index_python.packages": "ament_index_python: *",
    "bondpy.bondpy": "bondpy: Bond as_float_duration as_ros_duration",
    "camera_info_manager.camera_info_manager": "camera_info_manager: *",
    "cv_bridge.boost": "",
    "cv_bridge.boost.cv_bridge_boost": "cv_bridge: CV_MAT_CNWrap CV_MAT_DEPTHWrap cvtColor2"
    " cvtColorForDisplay getCvType",
    "cv_bridge.core": "cv_bridge: CvBridge CvBridgeError",
    "diagnostic_updater._diagnostic_status_wrapper": "diagnostic_updater: ERROR OK WARN"
    " DiagnosticStatusWrapper",
    "diagnostic_updater._diagnostic_updater": "diagnostic_updater: CompositeDiagnosticTask"
    " DiagnosticTask DiagnosticTaskVector FunctionDiagnosticTask Updater",
    "diagnostic_updater._publisher": "diagnostic_updater: DiagnosedPublisher"
    " HeaderlessTopicDiagnostic TopicDiagnostic",
    "diagnostic_updater._update_functions": "diagnostic_updater: FrequencyStatus"
    " FrequencyStatusParam Heartbeat TimeStampStatus TimeStampStatusParam",
    "dynamic_reconfigure.encoding": "rosz.reconfigure: Config; rosz.reconfigure.messages:"
    " decode_config decode_description encode_config encode_description encode_groups"
    " extract_params get_tree group_dict in_groups initial_config",
    "dynamic_reconfigure.exceptions": "dynamic_reconfigure: DynamicReconfigureCallbackException"
    " DynamicReconfigureException DynamicReconfigureParameterException",
    # The second part only loads roslib.
    "dynamic_reconfigure.parameter_generator": "dynamic_reconfigure.parameter_generator_catkin:"
    " ParameterGenerator Template bool_t double_t inspect int_t os re str_t sys; roslib:;"
    " rosz.ros1.tools: roslib",
    "genmsg.msgs": "roslib.msgs: BUILTIN_TYPES COMMENTCHAR CONSTCHAR DURATION PRIMITIVE_TYPES TIME"
    " bare_msg_type=base_msg_type is_builtin is_header_type is_valid_constant_type"
    " is_valid_msg_field_name is_valid_msg_type parse_type resolve_type; genmsg: EXT_MSG HEADER SEP"
    " InvalidMsgSpec",
    "genmsg.names": f"genmsg: PRN_SEPARATOR normalize_package_context {_NAMES}",
    "genpy.dynamic": "genpy: generate_dynamic",
    "genpy.message": f"{_MESSAGE} MessageException is_simple",
    "genpy.rostime": "genpy: Duration TVal Time",
    "image_geometry.cameramodels": "image_geometry: PinholeCameraModel StereoCameraModel mkmat",
    "interactive_markers.interactive_marker_server": "interactive_markers: Header InteractiveMarker"
    " InteractiveMarkerFeedback InteractiveMarkerInit InteractiveMarkerPose InteractiveMarkerServer"
    " InteractiveMarkerUpdate Lock MarkerContext UpdateContext rospy",
    "interactive_markers.menu_handler": "interactive_markers: EntryContext"
    " InteractiveMarkerFeedback MenuEntry MenuHandler rospy",
    "laser_geometry.laser_geometry": "laser_geometry: LaserProjection",
    "rclpy._rclpy_pybind11": "rclpy.exceptions: InvalidHandle RCLError",
    "rclpy.action.client": "rclpy.action: ActionClient ClientGoalHandle GoalStatus",
    "rclpy.action.server": "rclpy.action: ActionServer CancelResponse GoalResponse"
    " ServerGoalHandle",
    "rclpy.callback_groups": "rclpy.executors: CallbackGroup MutuallyExclusiveCallbackGroup"
    " ReentrantCallbackGroup",
    "rclpy.client": "rclpy.entities: Client",
    "rclpy.clock": "rclpy.time: Clock ClockChange ClockType JumpHandle JumpThreshold ROSClock"
    " TimeJump",
    "rclpy.clock_type": "rclpy.time: ClockType",
    "rclpy.constants": "rclpy.time: S_TO_NS=CONVERSION_CONSTANT",
    "rclpy.context": "rclpy.context: Context",
    "rclpy.duration": "rclpy.time: Duration Infinite",
    "rclpy.event_handler": "rclpy.events: EventHandler PublisherEventCallbacks"
    " QoSEventHandler=EventHandler QoSMessageLostInfo=MessageLostInfo"
    " QoSPublisherMatchedInfo=MatchedInfo QoSSubscriptionMatchedInfo=MatchedInfo"
    " SubscriptionEventCallbacks IncompatibleTypeInfo UnsupportedEventTypeError",
    "rclpy.executors": "rclpy.executors: Entity Executor ExternalShutdownException"
    " MultiThreadedExecutor ShutdownException SingleThreadedExecutor TimeoutException"
    " await_or_execute=completed",
    "rclpy.expand_topic_name": "rclpy.program: expand_topic_name",
    "rclpy.experimental": "rclpy.executors: EventsExecutor=SingleThreadedExecutor",
    "rclpy.experimental.events_executor": "",
    "rclpy.guard_condition": "rclpy.events: GuardCondition",
    "rclpy.handle": "rclpy.exceptions: InvalidHandle",
    "rclpy.impl": "rclpy: logging",
    "rclpy.impl.implementation_singleton": "rclpy: rclpy_implementation=exceptions",
    "rclpy.impl.logging_severity": "rclpy.logging: LoggingSeverity",
    "rclpy.impl.rcutils_logger": "rclpy.logging: RcutilsLogger get_logger",
    "rclpy.lifecycle.managed_entity": "rclpy.lifecycle: ManagedEntity SimpleManagedEntity",
    "rclpy.lifecycle.node": "rclpy.lifecycle: *",
    "rclpy.parameter": "rclpy.parameter: PARAMETER_SEPARATOR_STRING Parameter get_parameter_value"
    " parameter_dict_from_yaml_file parameter_value_to_python",
    "rclpy.publisher": "rclpy.entities: Publisher",
    "rclpy.qos_event": "rclpy.events: PublisherEventCallbacks SubscriptionEventCallbacks"
    " UnsupportedEventTypeError",
    "rclpy.qos_overriding_options": "rclpy.qos: InvalidQosOverridesError QoSOverridingOptions"
    " QosCallbackResult=SetParametersResult",
    "rclpy.serialization": "rclpy.program: deserialize_message serialize_message",
    "rclpy.service": "rclpy.entities: Service",
    "rclpy.service_introspection": "rclpy.entities: ServiceIntrospectionState",
    "rclpy.signals": "rclpy.program: SignalHandlerOptions",
    "rclpy.subscription": "rclpy.entities: Subscription",
    "rclpy.task": "rclpy.executors: Future Task",
    "rclpy.time": "rclpy.time: CONVERSION_CONSTANT ClockType Duration Time",
    "rclpy.timer": "rclpy.entities: Timer; rclpy.time: Rate",
    "rclpy.topic_endpoint_info": "rclpy.qos: QoSHistoryPolicy TopicEndpointInfo"
    " TopicEndpointTypeEnum",
    "rclpy.utilities": "rclpy.program: get_default_context get_rmw_implementation_identifier ok"
    " remove_ros_args shutdown try_shutdown",
    "rclpy.wait_for_message": "rclpy.program: wait_for_message",
    "ros2cli": "",
    "ros2cli.node": "",
    "ros2cli.node.strategy": "rclpy.program: NodeStrategy",
    "ros2topic": "",
    "ros2topic.api": "rclpy.program: get_topic_names_and_types",
    "rosidl_runtime_py.convert": "rosidl_runtime_py: message_to_csv message_to_ordereddict"
    " message_to_yaml",
    "rosidl_runtime_py.set_message": "rosidl_runtime_py: set_message_fields",
    "rosidl_runtime_py.utilities": "rosidl_runtime_py: get_action get_interface get_message"
    " get_service",
    "ros_numpy.geometry": "ros_numpy: Point Pose Quaternion Transform Vector3 converts_from_numpy"
    " converts_to_numpy np numpy_to_point numpy_to_pose numpy_to_quat numpy_to_transform"
    " numpy_to_vector3 point_to_numpy pose_to_numpy quat_to_numpy transform_to_numpy"
    " transformations vector3_to_numpy",
    "ros_numpy.image": "ros_numpy: Image converts_from_numpy converts_to_numpy image_to_numpy"
    " name_to_dtypes np numpy_to_image sys",
    "ros_numpy.occupancy_grid": "ros_numpy: MapMetaData OccupancyGrid converts_from_numpy"
    " converts_to_numpy np numpy_to_occupancy_grid occupancygrid_to_numpy sys",
    "ros_numpy.point_cloud2": "ros_numpy: DUMMY_FIELD_PREFIX PointCloud2 PointField"
    " array_to_pointcloud2 converts_from_numpy converts_to_numpy dtype_to_fields fields_to_dtype"
    " get_xyz_points merge_rgb_fields np nptype_to_pftype pftype_sizes pftype_to_nptype"
    " pointcloud2_to_array pointcloud2_to_xyz_array split_rgb_field type_mappings",
    "ros_numpy.registry": "ros_numpy: converts_from_numpy converts_to_numpy msgify numpify",
    "rosbag.bag": "rosbag: Bag BagMessage BagMessageWithConnectionHeader Compression"
    " CompressionTuple ROSBagEncryptException ROSBagEncryptNotSupportedException ROSBagException"
    " ROSBagFormatException ROSBagUnindexedException TopicTuple TypesAndTopicsTuple",
    "rosbag.rosbag_main": "rosbag: rosbagmain",
    "rosgraph.impl": "",
    "rosgraph.rosenv": "rosgraph.names: DEFAULT_MASTER_PORT DEFAULT_MASTER_URI ROS_HOSTNAME ROS_IP"
    " ROS_IPV6 ROS_MASTER_URI ROS_NAMESPACE get_master_uri",
    "roslaunch.arg_dump": "roslaunch.node_args: dump_args get_args",
    "roslaunch.launch": "roslaunch.parent: ROSLaunchRunner; roslaunch.core: RLException",
    "roslaunch.nodeprocess": "roslaunch.pmon: LocalProcess=Process",
    "roslaunch.param_dump": "roslaunch.node_args: dump_params",
    "roslaunch.rlutil": "roslaunch.node_args: check_log_disk_usage check_roslaunch"
    " resolve_launch_arguments; roslaunch.parent: get_or_generate_uuid",
    "roslaunch.scriptapi": "roslaunch.parent: ROSLaunch",
    "roslaunch.substitution_args": "roslaunch.loader: ArgException SubstitutionException"
    " resolve_args",
    "roslaunch.xmlloader": "roslaunch.loader: LoadException Loader XmlLoader XmlParseException",
    "roslib.exceptions": "roslib.packages: ROSLibException",
    "roslib.launcher": "roslib.packages: get_depends load_manifest",
    "roslib.message": f"{_MESSAGE}; rosz.time: TVal=StampValue",
    "roslib.names": f"genmsg: PRN_SEPARATOR {_NAMES}; roslib.packages: TYPE_SEPARATOR;"
    " rosgraph.names: ANYTYPE GLOBALNS PRIV_NAME REMAP SEP anonymous_name canonicalize_name"
    " get_ros_namespace is_global is_legal_base_name is_legal_name is_private load_mappings"
    " make_caller_id make_global_ns namespace ns_join resolve_name",
    "roslib.network": "rosgraph.network: ROSHandshakeException create_local_xmlrpc_uri"
    " decode_ros_handshake_header encode_ros_handshake_header get_address_override get_bind_address"
    " get_host_name get_local_address get_local_addresses is_local_address; rosgraph.names:"
    " ROS_HOSTNAME ROS_IP",
    "roslib.resources": "roslib.packages: list_package_resources list_package_resources_by_dir",
    "roslib.rosenv": "rosgraph.names: ROS_HOSTNAME ROS_IP ROS_MASTER_URI ROS_NAMESPACE"
    " get_master_uri; rospkg: ROS_HOME ROS_LOG_DIR ROS_PACKAGE_PATH ROS_ROOT get_log_dir"
    " get_ros_home get_test_results_dir",
    "roslib.rospack": "roslib.packages: list_pkgs rospack_depends rospack_depends_1"
    " rospack_depends_on rospack_depends_on_1; rospkg: ResourceNotFound RosPack",
    "roslib.scriptutil": "roslib.packages: get_master get_param_server=get_master; rosgraph.names:"
    " script_resolve_name",
    "roslib.srvs": "genmsg: EXT=EXT_SRV SEP; roslib.msgs: COMMENTCHAR IODELIM list_srv_types"
    " srv_file",
    "rospkg.common": "rospkg: MANIFEST_FILE PACKAGE_FILE ResourceNotFound",
    "rospkg.environment": "rospkg: ROS_ETC_DIR ROS_HOME ROS_LOG_DIR ROS_PACKAGE_PATH ROS_ROOT"
    " ROS_TEST_RESULTS_DIR get_etc_ros_dir get_log_dir get_ros_home get_ros_package_path"
    " get_ros_paths get_ros_root get_test_results_dir on_ros_path",
    "rospkg.manifest": "rospkg: MANIFEST_FILE PACKAGE_FILE Depend Export InvalidManifest Manifest"
    " ResourceNotFound RosDep read_manifest",
    "rospkg.rospack": "rospkg: ManifestManager list_by_path RosPack RosStack get_package_name",
    "rospy.impl": "",
    "rospy.impl.rosout": "rospy.core: _rospy_to_logging_levels",
    "rospy.impl.tcpros": "rospy.topics: DEFAULT_BUFF_SIZE",
    "rospy.impl.tcpros_base": "rospy.topics: DEFAULT_BUFF_SIZE",
    "rospy.impl.tcpros_service": "rospy.service: Service ServiceException ServiceImpl=Service"
    " ServiceProxy convert_return_to_response wait_for_service",
    "smach.exceptions": "smach.util: InvalidConstructionError InvalidStateError"
    " InvalidTransitionError InvalidUserCodeError SmachError",
    "smach.log": "smach.util: logdebug logerr loginfo logwarn set_loggers",
    "smach.sequence": "smach: Sequence",
    "smach.state_machine": "smach: StateMachine",
    "smach_ros.condition_state": "smach_ros: ConditionState",
    "smach_ros.monitor_state": "smach_ros: MonitorState",
    "smach_ros.ros_state": "smach_ros: RosState",
    "smach_ros.service_state": "smach_ros.callback_states: ServiceState",
    "smach_ros.simple_action_state": "smach_ros.callback_states: SimpleActionState",
    "smach_ros.util": "smach_ros: set_preempt_handler",
    "tf.broadcaster": "tf: TransformBroadcaster",
    "tf.listener": "tf: ConnectivityException Exception ExtrapolationException LookupException"
    " TransformListener Transformer TransformerROS",
    # ROS 1 connects the two types of /tf, which are equal but for their names.
    "tf.msg": "rosz.msgs.tf2_msgs.msg: tfMessage=TFMessage",
    "tf2_geometry_msgs.tf2_geometry_msgs": "tf2_geometry_msgs: do_transform_point do_transform_pose"
    " do_transform_vector3 do_transform_wrench from_msg_msg to_msg_msg transform_to_kdl",
    "tf2_kdl.tf2_kdl": "tf2_kdl: *",
    "tf2_ros.buffer_client": "tf2_ros: BufferClient",
    "tf2_ros.buffer_server": "tf2_ros: BufferServer",
    "tf2_ros.static_transform_broadcaster": "tf2_ros.buffer: StaticTransformBroadcaster",
    "tf2_ros.transform_broadcaster": "tf2_ros.buffer: TransformBroadcaster node_of",
    "tf2_ros.transform_listener": "tf2_ros.buffer: TransformListener",
    "tf2_sensor_msgs.tf2_sensor_msgs": "tf2_sensor_msgs: do_transform_cloud",
    "tf_conversions.posemath": "tf_conversions: Equal Frame Point Pose Quaternion Rotation"
    " SetToZero Twist Vector Wrench addDelta diff dot fromCameraParams fromMatrix fromMsg fromTf"
    " numpy toMatrix toMsg toTf transformations",
}
"""Submodules without a file of their own, and the names that they hold of other modules.

The parts of a text are ``MODULE: NAMES``, as in `Module.names`; semicolons separate them.
"""


def _parts(text: str) -> dict[str, str]:
    parts = (part.partition(":") for part in text.split(";") if part)
    return {home.strip(): names.strip() for home, _, names in parts}


MODULES: Mapping[str, Module] = {
    **{
        name: Module(f"ros1.{part}.{name}", extras=_EXTRAS.get(name, {}))
        for part, names in (("client", _CLIENT), ("tools", _TOOLS), ("libraries", _LIBRARIES))
        for name in names.split()
    },
    "ament_index_python": Module("ros2.ament_index_python"),
    "rclpy": Module("ros2.rclpy"),
    "rosgraph.impl.graph": Module("ros1.tools.rosgraph.graph"),
    "rosidl_runtime_py": Module("ros2.rosidl_runtime_py"),
    "rospy.exceptions": Module("ros1.exceptions"),
    "sensor_msgs.point_cloud2": Module("ros1.client.point_cloud2"),
    "sensor_msgs_py": Module("ros2.sensor_msgs_py", extras=_NUMPY),
    "tf_transformations": Module("ros1.client.tf.transformations"),
    **{name: Module(names=_parts(text)) for name, text in _BUILT.items()},
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


_RCLPY_NAMES = {
    name.partition("=")[0]: module
    for module, text in _BUILT.items()
    if module.startswith("rclpy.")
    for names in _parts(text).values()
    for name in names.split()
}
for _home, _names in (
    ("rcl_interfaces.msg", "ParameterDescriptor ParameterType ParameterValue SetParametersResult"),
    ("rclpy.exceptions", "ParameterNotDeclaredException ParameterUninitializedException"),
    ("rclpy.qos", "QoSProfile"),
):
    _RCLPY_NAMES |= dict.fromkeys(_names.split(), _home)
"""Names to import from any module of rclpy: editors import them from modules that use them."""


def home_of(name: str) -> str:
    """Return the module of rosz that a name in the tables of `MODULES` stands for."""
    root, dot, below = name.partition(".")
    return f"rosz.{MODULES[root].home}{dot}{below}" if root != "rosz" else name


def submodule(name: str) -> ModuleType:
    """Build a module of `MODULES` that has no file, such as ``rospy.impl.tcpros``."""
    module = ModuleType(name, f"``{name}``: names that programs import from here.")
    for home, names in MODULES[name].names.items():
        defined = import_module(home_of(home))
        for each in defined.__all__ if names == "*" else names.split():
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
    """Give a module without ``__all__`` one: the public names that it defines.

    What a package imports of its own modules counts as defined there. ROS 1's modules have no
    ``__all__``; ``import *`` of them must not bind what rosz imports from elsewhere.
    """
    own = [key for key, value in vars(module).items() if key[0] != "_" and _defines(module, value)]
    vars(module).setdefault("__all__", tuple(sorted(own)))


def _defines(module: ModuleType, value: object) -> bool:
    if isinstance(value, type | FunctionType):
        return f"{value.__module__}.".startswith(f"{module.__name__}.")
    return isinstance(value, _VALUES) or type(value).__module__ == module.__name__


def explain_missing(name: str, module: ModuleType) -> None:
    """Make a module and its loaded submodules name replacements of missing names."""
    own = f"{module.__name__}."
    inner = [each for each in vars(module).values() if isinstance(each, ModuleType)]
    for each in (module, *(each for each in inner if each.__name__.startswith(own))):
        shown = name + each.__name__.removeprefix(module.__name__)
        homes = _RCLPY_NAMES if shown.startswith("rclpy") else {}
        vars(each).setdefault("__getattr__", attribute(shown, each, homes))


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
