"""rostopic as a module: topics, their types and rates, and publishing by name (ROS wiki, rostopic).

``CallbackEcho``, ``ROSTopicBandwidth``, ``ROSTopicDelay`` and what reads command lines are not
there; ``rosz topic`` is the command, and `rosz.introspect` what it is made of.
"""

from rosz.ros1.rostopic.publish import create_publisher, publish_message
from rosz.ros1.rostopic.rate import ROSTopicHz
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

__all__ = (
    "NAME",
    "ROSTopicException",
    "ROSTopicHz",
    "ROSTopicIOException",
    "create_publisher",
    "find_by_type",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
    "publish_message",
)
