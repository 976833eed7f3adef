"""Bridges: programs that speak other protocols than rosz take part in its network."""

PUBLIC_MODULES = ("assets",)

__all__ = ()
