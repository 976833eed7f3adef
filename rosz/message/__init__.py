"""Messages at run time: their base classes, the plain codec, conversions to and from text.

The classes themselves are generated (``rosz.idl``) and live in ``rosz.msgs`` or are compiled by
``rosz.typestore``. Nothing in here knows a definition file; a class describes itself by its schema.
"""

from __future__ import annotations

from rosz.message.base import Array, Bytes, Message, Sequenced, Service

__all__ = ("Array", "Bytes", "Message", "Sequenced", "Service")
