"""The addresses of all pages."""

from __future__ import annotations

from urllib.parse import quote

from fastapi import Response
from fastapi.responses import FileResponse, StreamingResponse
from nicegui import app, ui

from rosz.errors import NotFoundError, RoszError
from rosz.web.model import System
from rosz.web.pages.actions import show_actions
from rosz.web.pages.bags import show_bags
from rosz.web.pages.console import Wanted, show_console
from rosz.web.pages.drive import show_drive
from rosz.web.pages.graph import show_graph
from rosz.web.pages.images import show_images
from rosz.web.pages.launches import show_output
from rosz.web.pages.overview import show_overview
from rosz.web.pages.parameters import show_parameters
from rosz.web.pages.plot import show_plot
from rosz.web.pages.reconfigure import show_reconfigure
from rosz.web.pages.services import show_services
from rosz.web.pages.topics import show_topics

__all__ = ("add_pages",)

_FRESH = {"Cache-Control": "no-store"}


def add_pages(system: System) -> None:
    """Give every page its address."""
    _add_pages_of_data(system)
    _add_pages_of_nodes(system)
    _add_pages_of_launches(system)
    _add_pictures(system)
    _add_downloads(system)

    @ui.page("/")
    def overview() -> None:
        show_overview(system)

    @ui.page("/graph")
    def graph(  # the choices that an address holds
        content: str = "nodes",
        nodes: str = "",
        topics: str = "",
        *,
        group: int = 0,
        hide: str = "usual",
        labels: str = "rates",
        pick: str = "",
    ) -> None:
        show_graph(system, content, nodes, topics, group=group, hide=hide, labels=labels, pick=pick)


def _add_pages_of_launches(system: System) -> None:
    @ui.page("/output")
    def output(node: str = "") -> None:
        show_output(system, node)


def _add_pages_of_data(system: System) -> None:
    @ui.page("/topics")
    def topics(topic: str = "", field: str = "", condition: str = "") -> None:
        show_topics(system, topic, field, condition)

    @ui.page("/images")
    def images(topics: str = "") -> None:
        show_images(system, topics)

    @ui.page("/drive")
    def drive(topic: str = "") -> None:
        show_drive(system, topic)

    @ui.page("/3d")
    def scene(frame: str = "", show: str = "", view: str = "") -> None:
        from rosz.web.pages.scene import show_scene

        show_scene(system, frame, show, view)

    @ui.page("/console")
    def console(
        node: str = "", level: str = "DEBUG", pattern: str = "", begin: str = "", end: str = ""
    ) -> None:
        show_console(system, Wanted(node, level, pattern, begin, end))


def _add_pages_of_nodes(system: System) -> None:
    @ui.page("/parameters")
    def parameters(prefix: str = "", name: str = "") -> None:
        show_parameters(system, prefix, name)

    @ui.page("/plot")
    def plot(fields: str = "", window: int = 10, times: str = "arrival") -> None:
        show_plot(system, fields, window, times)

    @ui.page("/reconfigure")
    def reconfigure(server: str = "") -> None:
        show_reconfigure(system, server)

    @ui.page("/services")
    def services(service: str = "") -> None:
        show_services(system, service)

    @ui.page("/bags")
    def bags(bag: str = "") -> None:
        show_bags(system, bag)

    @ui.page("/actions")
    def actions(action: str = "") -> None:
        show_actions(system, action)


def _add_pictures(system: System) -> None:
    @app.get("/picture/{key}")
    def picture(key: str) -> Response:  # a plain function: it runs on another thread
        try:
            found = system.pictures.take(key)
        except RoszError as error:
            return Response(str(error), status_code=503, headers=_FRESH)
        if found is None:
            # The view was removed while the browser asked; it would report any error.
            return Response(status_code=204, headers=_FRESH)
        return Response(found[0], media_type=found[1], headers=_FRESH)


def _add_downloads(system: System) -> None:
    @app.get("/bag/{name}")
    def download(name: str) -> Response:  # a plain function: it runs on another thread
        try:
            path, pieces = system.bags.open(name)
        except NotFoundError as error:
            return Response(str(error), status_code=404, headers=_FRESH)
        except RoszError as error:
            return Response(str(error), status_code=403, headers=_FRESH)
        if pieces is None:
            return FileResponse(path, filename=name, headers=_FRESH)
        attachment = f"attachment; filename*=utf-8''{quote(name)}.tar"
        return StreamingResponse(
            pieces,
            media_type="application/x-tar",
            headers={**_FRESH, "Content-Disposition": attachment},
        )
