"""map_server: the programs ``map_server`` and ``map_saver``, maps as images with a YAML file.

PGM is read and written here; other kinds of images need Pillow.
"""

from __future__ import annotations

import math
import re
import sys
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import yaml

from rosz.errors import RoszError
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Point, Pose, Quaternion
from rosz.msgs.nav_msgs.msg import MapMetaData, OccupancyGrid
from rosz.msgs.nav_msgs.srv import GetMap, LoadMap
from rosz.node import Node, serve_loggers
from rosz.remap import parse
from rosz.transforms import to_rpy

_MODES = ("trinary", "scale", "raw")
_UNKNOWN = -1
_FREE_PIXEL, _UNKNOWN_PIXEL, _OCCUPIED_PIXEL = 254, 205, 0
_SAVE_USAGE = "usage: map_saver [--occ PERCENT] [--free PERCENT] [-f NAME] [map:=TOPIC]"
_PERCENT = 100
_WHITE, _TWO_BYTES = 0xFF, 0xFFFF
_PGM_HEAD = re.compile(rb"(P[25])" + 3 * rb"(?:\s|#[^\n]*\n)+(\d+)" + rb"\s")


class MapError(RoszError):
    """A map cannot be read or written."""


class Image(msgspec.Struct, frozen=True):
    """An image as bytes, row by row from the top.

    Attributes:
        channels: Bytes of a pixel.
        alpha: Whether the last one of them is its opacity.
    """

    width: int
    height: int
    channels: int
    alpha: bool
    data: bytes


def read_image(path: Path) -> Image:
    """Read an image; kinds other than PGM need Pillow."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MapError(f"image '{path}' cannot be read: {error.strerror}") from error
    if data.startswith((b"P2", b"P5")):
        return _read_pgm(path, data)
    try:
        from PIL import Image as Pillow
        from PIL import UnidentifiedImageError
    except ModuleNotFoundError as error:
        raise MapError(
            f"image '{path}' is not PGM, and other kinds need Pillow: pip install 'rosz[maps]'"
        ) from error
    try:
        with Pillow.open(path) as opened:
            kind = {"1": "L", "LA": "RGBA", "P": "RGB", "I;16": "L", "I": "L"}.get(opened.mode)
            image = opened.convert(kind) if kind else opened.copy()
    except (UnidentifiedImageError, OSError) as error:
        raise MapError(f"image '{path}' cannot be read: {error}") from error
    alpha = image.mode == "RGBA"
    return Image(*image.size, len(image.getbands()), alpha, image.tobytes())


def _read_pgm(path: Path, data: bytes) -> Image:
    """Read a grey map, with binary or textual values (netpbm, pgm)."""
    head = _PGM_HEAD.match(data)
    width, height, most = map(int, head.group(2, 3, 4)) if head else (0, 0, 0)
    if head is None or not (width and height and 0 < most <= _TWO_BYTES):
        raise MapError(f"image '{path}' has no header of a PGM file: P5, width, height, maximum")
    body = data[head.end() :]
    values: Sequence[int] = body
    if head[1] == b"P2":
        values = [int(word) for word in body.split() if word.isdigit()]
    elif most > _WHITE:
        values = [high << 8 | low for high, low in zip(body[::2], body[1::2], strict=False)]
    count = width * height
    if len(values) < count:
        raise MapError(f"image '{path}' has {len(values)} of {count} pixels")
    if most != _WHITE:
        values = [min(value, most) * _WHITE // most for value in values[:count]]
    return Image(width, height, 1, alpha=False, data=bytes(values[:count]))


def occupancy(image: Image, *, negate: bool, occupied: float, free: float, mode: str) -> array[int]:
    """Return the cells of a map, row by row from the bottom.

    Args:
        image: The image.
        negate: Whether dark pixels are free.
        occupied: Share of darkness above which a cell is occupied.
        free: Share of darkness below which it is free.
        mode: ``trinary`` (0, 100 or -1), ``scale`` (values between as well) or ``raw`` (as it is).
    """
    averaged = image.channels - (image.alpha and mode != "trinary")
    cell_of_pixel: dict[bytes, int] = {}
    width, size = image.width, image.channels
    cells = array("b")
    for row in range(image.height - 1, -1, -1):
        line = image.data[row * width * size : (row + 1) * width * size]
        for at in range(0, len(line), size):
            pixel = line[at : at + size]
            value = cell_of_pixel.get(pixel)
            if value is None:
                mean = sum(pixel[:averaged]) / averaged
                shade = _WHITE - mean if negate else mean
                opaque = not image.alpha or pixel[-1] >= 1
                value = cell_of_pixel[pixel] = _cell(shade, occupied, free, mode, opaque=opaque)
            cells.append(value)
    return cells


def _cell(shade: float, occupied: float, free: float, mode: str, *, opaque: bool) -> int:
    if mode == "raw":
        whole = int(shade)
        return whole - 0x100 if whole >= 0x80 else whole  # noqa: PLR2004  # a signed byte
    darkness = (_WHITE - shade) / _WHITE
    if darkness > occupied:
        return _PERCENT
    if darkness < free:
        return 0
    if mode == "trinary" or not opaque:
        return _UNKNOWN
    return int(1 + 98 * (darkness - free) / (occupied - free))


def load_map(path: Path) -> OccupancyGrid:
    """Read a map from its YAML file, without a frame or times."""
    try:
        fields = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise MapError(f"map '{path}' cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise MapError(f"map '{path}' is not YAML: {error}") from error
    if not isinstance(fields, dict):
        raise MapError(f"map '{path}' has no fields; expected image, resolution, origin …")
    mode = fields.get("mode", "trinary")
    if mode not in _MODES:
        raise MapError(f"map '{path}': mode is '{mode}'; expected one of {', '.join(_MODES)}")
    image = _field(fields, "image", path)
    if not isinstance(image, str) or not image:
        raise MapError(f"map '{path}': image is {image!r}; expected the path of an image")
    origin = _field(fields, "origin", path)
    if not isinstance(origin, list) or len(origin) < len("xyt"):
        raise MapError(f"map '{path}': origin is {origin!r}; expected [x, y, yaw]")
    return _grid(
        read_image(path.parent / image),
        resolution=_number(fields, "resolution", path),
        origin=[float(number) for number in origin],
        negate=bool(_number(fields, "negate", path)),
        occupied=_number(fields, "occupied_thresh", path),
        free=_number(fields, "free_thresh", path),
        mode=mode,
    )


def _field(fields: dict[str, Any], name: str, path: Path) -> Any:
    if name not in fields:
        raise MapError(f"map '{path}' has no '{name}'")
    return fields[name]


def _number(fields: dict[str, Any], name: str, path: Path) -> float:
    value = _field(fields, name, path)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise MapError(f"map '{path}': {name} is {value!r}; expected a number") from None


def _grid(
    image: Image, *, resolution: float, origin: Sequence[float], **thresholds: Any
) -> OccupancyGrid:
    half = origin[2] / 2
    pose = Pose(
        Point(origin[0], origin[1], 0.0), Quaternion(0.0, 0.0, math.sin(half), math.cos(half))
    )
    info = MapMetaData(resolution=resolution, width=image.width, height=image.height, origin=pose)
    return OccupancyGrid(info=info, data=occupancy(image, **thresholds))


class _MapServer:
    """Serve a map, and others that a client asks for."""

    def __init__(self, node: Node, grid: OccupancyGrid) -> None:
        self._node = node
        self._frame = node.params.get("~frame_id", "map", type=str)
        self._metadata = node.publisher("map_metadata", MapMetaData, latch=True)
        self._maps = node.publisher("map", OccupancyGrid, latch=True)
        self._publish(grid)
        node.service("static_map", GetMap, lambda _: [self._grid])
        node.service("change_map", LoadMap, self._change)

    def _publish(self, grid: OccupancyGrid) -> None:
        now = Time.from_nsec(self._node.now())
        grid.info.map_load_time = now
        grid.header.stamp = now
        grid.header.frame_id = self._frame
        self._grid = grid
        self._node.log.info(
            "Read a %d X %d map @ %.3f m/cell",
            grid.info.width,
            grid.info.height,
            grid.info.resolution,
        )
        self._metadata.publish(grid.info)
        self._maps.publish(grid)

    def _change(self, request: Any) -> Any:
        response = LoadMap.Response()
        try:
            self._publish(load_map(Path(request.map_url)))
        except MapError as error:
            self._node.log.error("%s", error)  # noqa: TRY400  # a wrong path needs no traceback
            response.result = LoadMap.Response.RESULT_UNDEFINED_FAILURE
        else:
            response.map = self._grid
            self._node.log.info("Changed map to %s", request.map_url)
        return response


def main() -> None:
    """Serve the map of the command line: a YAML file, or an image and a resolution."""
    words = parse(sys.argv[1:]).rest
    if len(words) not in {1, 2}:
        sys.exit("usage: map_server MAP.yaml")
    with Node("map_server", anonymous=True) as node:
        serve_loggers(node)
        try:
            grid = load_map(Path(words[0])) if len(words) == 1 else _plain_map(node, *words)
        except MapError as error:
            sys.exit(f"map_server: {error}")
        _MapServer(node, grid)
        node.spin()


def _plain_map(node: Node, image: str, resolution: str) -> OccupancyGrid:
    """Return the map of an image without a YAML file."""
    node.log.warning("Using deprecated map server interface. Please switch to new interface.")
    get = node.params.get
    try:
        cell = float(resolution)
    except ValueError:
        raise MapError(f"resolution is '{resolution}'; expected metres per pixel") from None
    return _grid(
        read_image(Path(image)),
        resolution=cell,
        origin=(0.0, 0.0, 0.0),
        negate=bool(get("~negate", 0)),
        occupied=get("~occupied_thresh", 0.65, type=float),
        free=get("~free_thresh", 0.196, type=float),
        mode="trinary",
    )


def write_map(grid: OccupancyGrid, name: str, *, occupied: int, free: int) -> None:
    """Write a map as ``NAME.pgm`` and ``NAME.yaml``.

    Args:
        grid: The map.
        name: Path without a suffix.
        occupied: Least value of an occupied cell.
        free: Largest value of a free cell.
    """
    info = grid.info
    pixels = bytes(
        _FREE_PIXEL
        if 0 <= cell <= free
        else _OCCUPIED_PIXEL
        if cell >= occupied
        else _UNKNOWN_PIXEL
        for cell in grid.data
    )
    rows = [pixels[at : at + info.width] for at in range(0, len(pixels), info.width or 1)]
    head = f"P5\n# CREATOR: rosz map_saver {info.resolution:.3f} m/pix\n"
    head += f"{info.width} {info.height}\n255\n"
    at, turn = info.origin.position, info.origin.orientation
    _, _, yaw = to_rpy((turn.x, turn.y, turn.z, turn.w))
    text = (
        f"image: {name}.pgm\nresolution: {info.resolution:f}\n"
        f"origin: [{at.x:f}, {at.y:f}, {yaw:f}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n\n"
    )
    try:
        Path(f"{name}.pgm").write_bytes(head.encode() + b"".join(reversed(rows)))
        Path(f"{name}.yaml").write_text(text, encoding="utf-8")
    except OSError as error:
        raise MapError(f"'{error.filename}' cannot be written: {error.strerror}") from error


def save() -> None:
    """Write the next map that comes on ``map``."""
    name, occupied, free = _save_options(list(parse(sys.argv[1:]).rest))
    with Node("map_saver") as node:
        serve_loggers(node)
        node.log.info("Waiting for the map")
        grid = next(iter(node.subscription("map", OccupancyGrid, queue_size=1)), None)
        if grid is None:
            return
        node.log.info(
            "Received a %d X %d map @ %.3f m/pix",
            grid.info.width,
            grid.info.height,
            grid.info.resolution,
        )
        try:
            write_map(grid, name, occupied=occupied, free=free)
        except MapError as error:
            sys.exit(f"map_saver: {error}")
        node.log.info("Wrote %s.pgm and %s.yaml", name, name)


def _save_options(words: list[str]) -> tuple[str, int, int]:
    if words == ["-h"]:
        sys.stdout.write(f"{_SAVE_USAGE}\n")
        sys.exit(0)
    values = {"-f": "map", "--occ": "65", "--free": "25"}
    if len(words) % 2 or not {*words[::2]} <= values.keys():
        sys.exit(_SAVE_USAGE)
    values.update(zip(words[::2], words[1::2], strict=True))
    try:
        occupied, free = int(values["--occ"]), int(values["--free"])
    except ValueError:
        sys.exit(_SAVE_USAGE)
    if not 1 <= occupied <= _PERCENT:
        sys.exit(f"map_saver: --occ is {occupied}; expected 1 to 100")
    if not 0 <= free < occupied:
        sys.exit(f"map_saver: --free is {free}; expected 0 up to less than --occ, {occupied}")
    return values["-f"], occupied, free
