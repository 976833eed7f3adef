"""The hash that ROS 1 identifies a definition by, by genmsg's rule.

Constants first, then fields, each on a line, comments and blanks gone; a field that is a message
stands as the hash of that message. ROS 2's spellings of what ROS 1 has built in count as ROS 1's:
``builtin_interfaces/Time`` as ``time``, and any ``std_msgs/Header`` as the one with ``seq``. So a
text that means the same in both worlds has the hash that ROS 1 gives it.
"""

from __future__ import annotations

import hashlib

from rosz.idl.catalog import Catalog
from rosz.idl.spec import FieldType, MessageSpec, ServiceSpec

__all__ = ("message_md5", "service_md5")

_BUILTIN = {"builtin_interfaces/msg/Time": "time", "builtin_interfaces/msg/Duration": "duration"}
_HEADER = "std_msgs/msg/Header"
_HEADER_MD5 = "2176decaecbce78abc3b96ef049fabed"


def message_md5(spec: MessageSpec, catalog: Catalog) -> str:
    """Return the 32 hexadecimal digits for a message."""
    if spec.name == _HEADER:
        return _HEADER_MD5
    return hashlib.md5(_text(spec, catalog).encode(), usedforsecurity=False).hexdigest()


def service_md5(spec: ServiceSpec, catalog: Catalog) -> str:
    """Return the 32 hexadecimal digits for a service."""
    text = _text(spec.request, catalog) + _text(spec.response, catalog)
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def _text(spec: MessageSpec, catalog: Catalog) -> str:
    lines = [f"{one.type} {one.name}={one.text}" for one in spec.constants]
    lines += [f"{_type(field.type, catalog)} {field.name}" for field in spec.fields]
    return "\n".join(lines).strip()


def _type(kind: FieldType, catalog: Catalog) -> str:
    if kind.primitive:
        return kind.written + kind.suffix
    if kind.base in _BUILTIN:
        return _BUILTIN[kind.base] + kind.suffix
    return message_md5(catalog.message(kind.base), catalog)
