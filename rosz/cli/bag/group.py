"""The group of commands that work on bags; each module beside this one declares some of them."""

from __future__ import annotations

from rosz.cli.call import new_group

__all__ = ("app",)

app = new_group("Record and play bags, show, change and repair them.")
