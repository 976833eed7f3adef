"""rosserial: devices on a serial line or a TCP connection as parts of a ROS network.

May import everything below the command line.
"""

from rosz.programs.rosserial.device import Device, TypeMismatch, UnknownTopic
from rosz.programs.rosserial.link import Link
from rosz.programs.rosserial.packets import Damage, Packet, PacketReader, pack
from rosz.programs.rosserial.ports import (
    FilePort,
    MissingSerial,
    Port,
    SerialPort,
    SocketPort,
    open_serial,
)
from rosz.programs.rosserial.server import TcpServer, main, serve_line

__all__ = (
    "Damage",
    "Device",
    "FilePort",
    "Link",
    "MissingSerial",
    "Packet",
    "PacketReader",
    "Port",
    "SerialPort",
    "SocketPort",
    "TcpServer",
    "TypeMismatch",
    "UnknownTopic",
    "main",
    "open_serial",
    "pack",
    "serve_line",
)
