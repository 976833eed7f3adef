"""The formats of bags: MCAP, that of ROS 1, and rosbag2."""

from rosz.lazy import exports_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosz.bags.formats.ros1_form import ros1_definition
    from rosz.bags.formats.ros1_reader import Ros1Reader
    from rosz.bags.formats.rosbag2_writer import write_metadata
    from rosz.bags.formats.writing import removed_unfinished
else:
    __getattr__ = exports_of(__name__)
