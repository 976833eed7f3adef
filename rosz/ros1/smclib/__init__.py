"""smclib: what state machines that the State Machine Compiler (SMC) generates import.

May import Python's library.
"""

from __future__ import annotations

PUBLIC_MODULES = ("statemap",)

__all__: tuple[str, ...] = ()
