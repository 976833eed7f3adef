"""Bridges: programs that speak other protocols than rosz take part in its network."""

from __future__ import annotations

PUBLIC_MODULES = ("assets",)

__all__ = ()
