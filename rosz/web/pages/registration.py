"""The addresses of all pages."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from urllib.parse import quote

from fastapi import Response
from fastapi.responses import FileResponse, StreamingResponse
from nicegui import app, ui

from rosz.errors import NotFoundError, RoszError
from rosz.web.model import System
from rosz.web.pages.actions import ActionsPage
from rosz.web.pages.bags import BagsPage
from rosz.web.pages.console import ConsolePage
from rosz.web.pages.drive import DrivePage
from rosz.web.pages.graph import GraphPage
from rosz.web.pages.images import ImagesPage
from rosz.web.pages.launches import OutputPage
from rosz.web.pages.overview import show_overview
from rosz.web.pages.parameters import ParametersPage
from rosz.web.pages.plot import PlotPage
from rosz.web.pages.reconfigure import ReconfigurePage
from rosz.web.pages.services import ServicesPage
from rosz.web.pages.topics import TopicsPage

_PAGES: dict[str, Callable[..., object]] = {
    "/": show_overview,
    "/actions": ActionsPage,
    "/bags": BagsPage,
    "/console": ConsolePage,
    "/drive": DrivePage,
    "/graph": GraphPage,
    "/images": ImagesPage,
    "/output": OutputPage,
    "/parameters": ParametersPage,
    "/plot": PlotPage,
    "/reconfigure": ReconfigurePage,
    "/services": ServicesPage,
    "/topics": TopicsPage,
}
_FRESH = {"Cache-Control": "no-store"}


def add_pages(system: System) -> None:
    """Give every page its address; its arguments come from the query."""
    for path, show in _PAGES.items():
        ui.page(path)(partial(show, system))
    _add_pictures(system)
    _add_downloads(system)

    @ui.page("/3d")
    def scene(frame: str = "", show: str = "", view: str = "") -> None:
        from rosz.web.pages.scene import ScenePage  # numpy takes a while

        ScenePage(system, frame, show, view)


def _add_pictures(system: System) -> None:
    @app.get("/picture/{key}")
    def picture(key: str) -> Response:  # a plain function: it runs on another thread
        try:
            stored = system.pictures.take(key)
        except RoszError as error:
            return Response(str(error), status_code=503, headers=_FRESH)
        if stored is None:
            # The view was removed while the browser asked; it would report any error.
            return Response(status_code=204, headers=_FRESH)
        return Response(stored[0], media_type=stored[1], headers=_FRESH)


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
