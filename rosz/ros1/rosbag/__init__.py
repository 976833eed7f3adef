"""rosbag: bags for ROS 1's scripts (ROS wiki, rosbag/Code API).

`bag` reads and writes them; bags of MCAP and rosbag2 are read as well. `migration` makes messages
of older definitions those of the types here, by rules. May import bags and the importer of types.
"""

from __future__ import annotations

from rosz.ros1.rosbag import migration
from rosz.ros1.rosbag.bag import (
    Bag,
    BagMessage,
    BagMessageWithConnectionHeader,
    Compression,
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
)
from rosz.ros1.rosbag.rosbag_main import rosbagmain

PUBLIC_MODULES = ("bag", "migration", "programs", "rosbag_main")

__all__ = (
    "Bag",
    "BagMessage",
    "BagMessageWithConnectionHeader",
    "Compression",
    "ROSBagEncryptException",
    "ROSBagEncryptNotSupportedException",
    "ROSBagException",
    "ROSBagFormatException",
    "ROSBagUnindexedException",
    "migration",
    "rosbagmain",
)
