"""genmsg: what scripts use of it: names of types, and the errors of definitions.

Its generator API (``MsgSpec``, ``MsgContext``, ``load_msg_by_type``, …) is not there; `rosz.idl` is
what rosz reads definitions with.
"""

from rosz.errors import DefinitionError as InvalidMsgSpec
from rosz.errors import TypeNotFound as MsgNotFound
from rosz.ros1.genmsg import names
from rosz.ros1.genmsg.names import (
    is_legal_resource_base_name,
    is_legal_resource_name,
    package_resource_name,
    resource_name,
    resource_name_base,
    resource_name_package,
)

__all__ = (
    "EXT_MSG",
    "EXT_SRV",
    "HEADER",
    "SEP",
    "InvalidMsgSpec",
    "MsgNotFound",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "names",
    "package_resource_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
)

SEP = "/"
EXT_MSG = ".msg"
EXT_SRV = ".srv"
HEADER = "Header"
