"""The addresses of all pages."""

from __future__ import annotations

from nicegui import ui

from rosz.web.model import System
from rosz.web.pages.console import show_console
from rosz.web.pages.graph import show_graph
from rosz.web.pages.overview import show_overview
from rosz.web.pages.parameters import show_parameters
from rosz.web.pages.plot import show_plot
from rosz.web.pages.reconfigure import show_reconfigure
from rosz.web.pages.services import show_services
from rosz.web.pages.topics import show_topics

__all__ = ("add_pages",)


def add_pages(system: System) -> None:
    """Give every page its address."""

    @ui.page("/")
    def overview() -> None:
        show_overview(system)

    @ui.page("/graph")
    def graph(content: str = "nodes", nodes: str = "", topics: str = "", group: int = 0) -> None:
        show_graph(system, content, nodes, topics, group)

    @ui.page("/topics")
    def topics(topic: str = "", field: str = "") -> None:
        show_topics(system, topic, field)

    @ui.page("/console")
    def console(node: str = "", level: str = "DEBUG", pattern: str = "") -> None:
        show_console(system, node, level, pattern)

    @ui.page("/parameters")
    def parameters(prefix: str = "") -> None:
        show_parameters(system, prefix)

    @ui.page("/plot")
    def plot(fields: str = "", window: int = 10) -> None:
        show_plot(system, fields, window)

    @ui.page("/reconfigure")
    def reconfigure(server: str = "") -> None:
        show_reconfigure(system, server)

    @ui.page("/services")
    def services(service: str = "") -> None:
        show_services(system, service)
