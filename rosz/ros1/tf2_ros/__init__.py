"""tf2_ros: transforms between coordinate frames (ROS wiki, tf2_ros)."""

from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.ros1.tf2_py import (
    BufferCore,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from rosz.ros1.tf2_ros.buffer import Buffer
from rosz.ros1.tf2_ros.buffer_client import BufferClient
from rosz.ros1.tf2_ros.buffer_interface import (
    BufferInterface,
    ConvertRegistration,
    NotImplementedException,
    Stamped,
    TransformRegistration,
    TypeException,
    convert,
)
from rosz.ros1.tf2_ros.buffer_server import BufferServer
from rosz.ros1.tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster
from rosz.ros1.tf2_ros.transform_broadcaster import TransformBroadcaster
from rosz.ros1.tf2_ros.transform_listener import TransformListener

__all__ = (
    "Buffer",
    "BufferClient",
    "BufferCore",
    "BufferInterface",
    "BufferServer",
    "ConnectivityException",
    "ConvertRegistration",
    "ExtrapolationException",
    "InvalidArgumentException",
    "LookupException",
    "NotImplementedException",
    "Stamped",
    "StaticTransformBroadcaster",
    "TFMessage",
    "TimeoutException",
    "TransformBroadcaster",
    "TransformException",
    "TransformListener",
    "TransformRegistration",
    "TransformStamped",
    "TypeException",
    "convert",
)
