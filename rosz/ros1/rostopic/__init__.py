"""rostopic: topics, their types and rates, and publishing by type name (ROS wiki, rostopic).

The command is that of rosz; ``rostopicmain`` runs it. It may import floors 0 to 6, and rospy.
"""

from __future__ import annotations

from rosz.ros1.rostopic.echo import (
    CallbackEcho,
    create_field_filter,
    create_value_transform,
)
from rosz.ros1.rostopic.echo import _str_plot as _str_plot
from rosz.ros1.rostopic.echo import _str_plot_fields as _str_plot_fields
from rosz.ros1.rostopic.measure import ROSTopicBandwidth, ROSTopicDelay, ROSTopicHz
from rosz.ros1.rostopic.publish import (
    SUBSCRIBER_TIMEOUT,
    argv_publish,
    create_publisher,
    file_yaml_arg,
    param_publish_once,
    publish_message,
    stdin_yaml_arg,
    wait_for_subscriber,
)
from rosz.ros1.rostopic.topics import (
    NAME,
    ROSTopicException,
    ROSTopicIOException,
    find_by_type,
    get_info_text,
    get_topic_class,
    get_topic_list,
    get_topic_type,
    msgevalgen,
)
from rosz.ros1.tool import Tool

__all__ = (
    "NAME",
    "SUBSCRIBER_TIMEOUT",
    "CallbackEcho",
    "ROSTopicBandwidth",
    "ROSTopicDelay",
    "ROSTopicException",
    "ROSTopicHz",
    "ROSTopicIOException",
    "argv_publish",
    "create_field_filter",
    "create_publisher",
    "create_value_transform",
    "file_yaml_arg",
    "find_by_type",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
    "param_publish_once",
    "publish_message",
    "rostopicmain",
    "stdin_yaml_arg",
    "wait_for_subscriber",
)

_tool = Tool(NAME)
rostopicmain = _tool.main
_fullusage = _tool.print_usage
globals().update(_tool.parts("bw delay echo find hz info list pub type"))
