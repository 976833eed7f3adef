"""Interface definitions: .msg and .srv text → spec → hashes → Python source. Pure.

``grammar`` reads one text, ``catalog`` joins texts by the names in them, ``typehash`` and ``md5``
identify the result to ROS 2 and ROS 1, ``encode``, ``decode`` and ``classes`` write Python, and
``generate`` writes whole packages.
"""

from __future__ import annotations

from rosz.idl.catalog import Catalog, Definition
from rosz.idl.grammar import parse_action, parse_message, parse_service
from rosz.idl.md5 import message_md5, service_md5
from rosz.idl.spec import ActionSpec, Constant, Field, FieldType, MessageSpec, ServiceSpec
from rosz.idl.typehash import message_hash, service_hash

__all__ = (
    "ActionSpec",
    "Catalog",
    "Constant",
    "Definition",
    "Field",
    "FieldType",
    "MessageSpec",
    "ServiceSpec",
    "message_hash",
    "message_md5",
    "parse_action",
    "parse_message",
    "parse_service",
    "service_hash",
    "service_md5",
)
