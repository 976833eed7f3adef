"""rosserial: devices on a serial line or a TCP connection as parts of a ROS network.

May import everything below the command line.
"""

from rosz.programs.rosserial.device import DeviceService, Half, check_definition
from rosz.programs.rosserial.link import DevicePort, FilePort, Link, open_serial
from rosz.programs.rosserial.packets import Damage, Packet, PacketReader, pack
from rosz.programs.rosserial.server import TcpServer, main
