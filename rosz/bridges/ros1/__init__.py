"""ROS 1's own protocol: its programs take part in the network, with rosz as their master.

``frames``, ``calls`` and ``registry`` are values: TCPROS and XML-RPC as bytes, and the table of
registrations. The others use sockets, nodes and the parameter store.
"""

from rosz.bridges.ros1.attach import AttachedBridge, CrossingNames
from rosz.bridges.ros1.bridge import MASTER_PORT, MasterBridge, open_master, running_master
