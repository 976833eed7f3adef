"""rostopic: topics, their types and rates, and publishing by type name (ROS wiki, rostopic).

The command is that of rosz; ``rostopicmain`` runs it. It may import floors 0 to 6, and rospy.
"""

from rosz.ros1.tool import Tool
from rosz.ros1.tools.rostopic import topics
from rosz.ros1.tools.rostopic.callbacks import (
    CallbackEcho,
    ROSTopicBandwidth,
    ROSTopicDelay,
    ROSTopicHz,
    create_field_filter,
    create_value_transform,
)
from rosz.ros1.tools.rostopic.callbacks import _str_plot as _str_plot
from rosz.ros1.tools.rostopic.callbacks import _str_plot_fields as _str_plot_fields
from rosz.ros1.tools.rostopic.topics import *  # noqa: F403

_tool = Tool(topics.NAME)
rostopicmain = _tool.main
_fullusage = _tool.print_usage
globals().update(_tool.parts("bw delay echo find hz info list pub type"))
