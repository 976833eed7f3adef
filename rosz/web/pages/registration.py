"""The addresses of all pages."""

from __future__ import annotations

from nicegui import ui

from rosz.web.model import System
from rosz.web.pages.overview import show_overview

__all__ = ("add_pages",)


def add_pages(system: System) -> None:
    """Give every page its address."""

    @ui.page("/")
    def overview() -> None:
        show_overview(system)
