"""``rosz srv``: what rossrv does."""

from __future__ import annotations

from rosz.cli.type_group import new_type_group

__all__ = ("app",)

app = new_type_group("srv", "service")
