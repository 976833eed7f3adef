"""Interface definitions: .msg, .srv and .action texts, their specs, hashes and Python source.

``grammar`` parses one text, ``catalog`` finds the types that it refers to, ``hashes`` identifies
the result to ROS 1 and ROS 2. ``classes`` writes Python, with the emitter of ``rosz.message``. The
module ``generate``, which writes the modules of packages, is public as well. Pure; may import
floor 0.
"""

from __future__ import annotations

from rosz.idl.cache import SourceCache
from rosz.idl.catalog import (
    Catalog,
    Definition,
    Folders,
    action_type,
    full_name,
    read_definition,
    split_definitions,
)
from rosz.idl.grammar import parse_action, parse_message, parse_service
from rosz.idl.hashes import (
    action_hash,
    describe,
    describe_field,
    identity,
    message_hash,
    message_md5,
    service_hash,
    service_md5,
    service_parts,
)
from rosz.idl.spec import (
    ActionSpec,
    Constant,
    Field,
    FieldType,
    MessageSpec,
    ServiceSpec,
    action_of,
    class_name,
    is_service,
    is_service_message,
)

PUBLIC_MODULES = ("generate",)

__all__ = (
    "ActionSpec",
    "Catalog",
    "Constant",
    "Definition",
    "Field",
    "FieldType",
    "Folders",
    "MessageSpec",
    "ServiceSpec",
    "SourceCache",
    "action_hash",
    "action_of",
    "action_type",
    "class_name",
    "describe",
    "describe_field",
    "full_name",
    "identity",
    "is_service",
    "is_service_message",
    "message_hash",
    "message_md5",
    "parse_action",
    "parse_message",
    "parse_service",
    "read_definition",
    "service_hash",
    "service_md5",
    "service_parts",
    "split_definitions",
)
